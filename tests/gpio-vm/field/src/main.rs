//! The field of examples/fast-interlock: moves its inputs, looks at its outputs, and judges the records.
//!
//! It runs as root in the virtual machine of tests/gpio-vm, where the kernel simulates the chip. One line per check, `ok NAME`
//! or `FAILED NAME: why`; the last line counts them, and the exit code is 1 when one has failed. Arguments name the checks to
//! do; without any, all are done.

#[path = "../../gpio-probe/src/chip.rs"]
mod chip;
mod edges;
mod ends;
mod field;
mod outputs;
mod run;

use chip::Chip;
use rustix::process::Signal;
use std::process::ExitCode;
use std::time::Instant;

type Done = Result<(), String>;
type Check = (&'static str, fn(&mut Chip) -> Done);

const CHECKS: &[Check] = &[
    ("ten-thousand-edges-once-each-in-order", edges::ten_thousand),
    ("outputs-follow", outputs::follow),
    ("a-line-held-by-another", edges::held),
    ("a-chip-that-goes-and-comes", ends::replugged),
    ("SIGTERM-leaves-outputs-safe", |chip| ends::ended(chip, Signal::TERM)),
    ("SIGINT-leaves-outputs-safe", |chip| ends::ended(chip, Signal::INT)),
    ("SIGHUP-leaves-outputs-safe", |chip| ends::ended(chip, Signal::HUP)),
    ("SIGKILL-leaves-outputs-as-they-were", |chip| ends::ended(chip, Signal::KILL)),
];

fn main() -> ExitCode {
    let chosen: Vec<String> = std::env::args().skip(1).collect();
    let checks = CHECKS.iter().filter(|(name, _)| chosen.is_empty() || chosen.iter().any(|c| c == name));
    let (mut failed, mut count) = (0, 0);
    for (name, check) in checks {
        count += 1;
        let begin = Instant::now();
        let done = Chip::new("latchwork-field", 32, &[]).and_then(|mut chip| check(&mut chip));
        println!("note: {name} took {:.1} s", begin.elapsed().as_secs_f64());
        match done {
            Ok(()) => println!("ok {name}"),
            Err(why) => {
                failed += 1;
                println!("FAILED {name}: {why}");
            }
        }
    }
    println!("{count} checks, {failed} failed");
    if failed == 0 && count > 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
