//! The field of examples/fast-interlock: moves its inputs, looks at its outputs, and judges the records.
//!
//! It runs as root in the virtual machine of tests/gpio-vm, where the kernel simulates the chip. One line per check, `ok NAME`
//! or `FAILED NAME: why`; the last line counts them, and the exit code is 1 when one has failed. Arguments name the checks to
//! do; without any, all are done.

#[path = "../../gpio-probe/src/chip.rs"]
mod chip;
mod run;

use chip::Chip;
use run::{Run, records, told, until};
use rustix::process::Signal;
use std::collections::BTreeMap;
use std::process::ExitCode;

const DOOR: usize = 17;
const BEAM: usize = 27;
const VACUUM: usize = 22;
const VALVE: usize = 13;
const INPUTS: [(usize, &str); 6] =
    [(DOOR, "door"), (BEAM, "beam"), (VACUUM, "vacuum"), (23, "level"), (24, "air"), (25, "heat")];
/// Edges that are made at random on the three fast lines.
const EDGES: usize = 10_000;

type Done = Result<(), String>;
type Check = (&'static str, fn(&mut Chip) -> Done);

const CHECKS: &[Check] = &[
    ("ten-thousand-edges-once-each-in-order", ten_thousand),
    ("outputs-follow", outputs_follow),
    ("a-line-held-by-another", held),
    ("a-chip-that-goes-and-comes", replugged),
    ("SIGTERM-leaves-outputs-safe", |chip| ended(chip, Signal::TERM)),
    ("SIGINT-leaves-outputs-safe", |chip| ended(chip, Signal::INT)),
    ("SIGKILL-leaves-outputs-as-they-were", |chip| ended(chip, Signal::KILL)),
];

fn main() -> ExitCode {
    let chosen: Vec<String> = std::env::args().skip(1).collect();
    let checks = CHECKS.iter().filter(|(name, _)| chosen.is_empty() || chosen.iter().any(|c| c == name));
    let (mut failed, mut count) = (0, 0);
    for (name, check) in checks {
        count += 1;
        let done = Chip::new("latchwork-field", 32, &[]).and_then(|mut chip| check(&mut chip));
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

/// All is well: contacts closed, which is low at the line.
fn well(chip: &Chip) {
    INPUTS.iter().for_each(|(line, _)| chip.pull(*line, false));
}

/// A plant that runs with everything well and all its actuators on.
fn running(chip: &Chip) -> Result<Run, String> {
    let run = Run::start(&chip.path())?;
    until("lane trip runs", || told("lane.trip", "started").len() == 1 && told("lane.main", "started").len() == 1)?;
    well(chip);
    until("the valve opens", || chip.value(VALVE))?;
    Ok(run)
}

/// Numbers without a pattern, the same every time.
fn random(state: &mut u64) -> usize {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as usize
}

fn ten_thousand(chip: &mut Chip) -> Done {
    let run = running(chip)?;
    let fast = [(DOOR, "gpio.door"), (BEAM, "gpio.beam"), (VACUUM, "gpio.vacuum")];
    let events = || -> Vec<(String, String, String)> {
        let text = |v: &serde_json::Value| v.as_str().unwrap_or_default().to_owned();
        let all = records().into_iter().filter(|r| r["kind"] == "event" && fast.iter().any(|f| r["source"] == f.1));
        all.map(|r| (text(&r["time"]), text(&r["source"]), text(&r["transition"]))).collect()
    };
    let settled = || {
        let before = events().len();
        std::thread::sleep(std::time::Duration::from_millis(500));
        before == events().len()
    };
    until("the first edges are recorded", settled)?;
    let first = events().len();
    let mut made: BTreeMap<&str, Vec<bool>> = BTreeMap::new();
    let (mut state, mut low) = (7, [true; 3]);
    for _ in 0..EDGES {
        let which = random(&mut state) % fast.len();
        low[which] = !low[which];
        chip.pull(fast[which].0, !low[which]);
        made.entry(fast[which].1).or_default().push(low[which]);
    }
    until("every edge is recorded", || events().len() >= first + EDGES)?;
    until("no more come", settled)?;
    let seen = events().split_off(first);
    let lost: Vec<_> = records().into_iter().filter(|r| r["kind"] == "lost").collect();
    if !lost.is_empty() {
        return Err(format!("{} records of lost edges: {}", lost.len(), lost[0]));
    }
    for (name, levels) in &made {
        let of: Vec<_> = seen.iter().filter(|e| e.1 == *name).collect();
        let right = of.len() == levels.len()
            && of.iter().zip(levels).all(|(e, active)| e.2 == if *active { "rising" } else { "falling" });
        if !right {
            return Err(format!(
                "{name}: {} edges were made, {} are recorded, or not in this order",
                levels.len(),
                of.len()
            ));
        }
        if let Some(w) = of.windows(2).find(|w| w[1].0 <= w[0].0) {
            return Err(format!("{name}: the stamps do not rise: {} then {}", w[0].0, w[1].0));
        }
    }
    if let Some(w) = seen.windows(2).find(|w| w[1].0 < w[0].0) {
        return Err(format!("the records are not in the order of their times: {:?} then {:?}", w[0], w[1]));
    }
    let status = run.end(Signal::TERM)?;
    if status.success() { Ok(()) } else { Err(format!("latchwork ended with {status}")) }
}

fn outputs_follow(chip: &mut Chip) -> Done {
    let run = running(chip)?;
    for n in 0..200 {
        let well = n % 2 == 1;
        chip.pull(VACUUM, !well);
        until("the valve follows the vacuum", || chip.value(VALVE) == well)?;
    }
    run.end(Signal::TERM).map(drop)
}

fn held(chip: &mut Chip) -> Done {
    let line = gpiocdev::Request::builder()
        .on_chip(&chip.device)
        .with_consumer("squatter")
        .with_line(BEAM as u32)
        .as_input()
        .request()
        .map_err(|e| format!("the line could not be taken: {e}"))?;
    let run = Run::start(&chip.path())?;
    until("the refusal names the holder", || {
        told("gpio.beam", "refused").iter().any(|r| r["text"].as_str().is_some_and(|t| t.contains("squatter")))
    })?;
    // The others work meanwhile.
    well(chip);
    chip.pull(DOOR, true);
    until("an edge of another line", || !told("gpio.door", "falling").is_empty())?;
    drop(line);
    until("the line is taken over", || told("gpio.beam", "accepted").len() == 1)?;
    chip.pull(BEAM, true);
    chip.pull(BEAM, false);
    until("its edges are recorded", || !told("gpio.beam", "rising").is_empty())?;
    run.end(Signal::TERM).map(drop)
}

fn replugged(chip: &mut Chip) -> Done {
    let run = Run::start("latchwork-field")?;
    until("lane trip runs", || told("lane.trip", "started").len() == 1)?;
    well(chip);
    until("the valve opens", || chip.value(VALVE))?;
    chip.unplug();
    until("the loss is recorded", || records().iter().any(|r| r["kind"] == "io" && r["transition"] == "lost"))?;
    chip.plug().map_err(|e| format!("the chip did not come back: {e}"))?;
    until("the return is recorded", || {
        told("gpio", "connected").len() > 1 || !told("gpio.vacuum", "connected").is_empty()
    })?;
    // A line that is opened is pulled up by its bias: whatever came back last must be pulled down again.
    until("the valve opens again", || {
        well(chip);
        chip.value(VALVE)
    })?;
    let before = told("gpio.vacuum", "falling").len();
    chip.pull(VACUUM, true);
    until("edges are recorded again", || told("gpio.vacuum", "falling").len() > before)?;
    until("outputs follow again", || !chip.value(VALVE))?;
    run.end(Signal::TERM).map(drop)
}

/// What the valve's line shows after a signal, while its request is kept open by a duplicate.
fn ended(chip: &mut Chip, signal: Signal) -> Done {
    let run = running(chip)?;
    let lines = run.hold_lines()?;
    let status = run.end(signal)?;
    let open = chip.value(VALVE);
    drop(lines);
    match (signal == Signal::KILL, open) {
        (false, false) if status.success() => Ok(()),
        (false, false) => Err(format!("latchwork ended with {status}")),
        (false, true) => Err("the valve is still open".into()),
        // Documented: a kill leaves nobody to write the safe values.
        (true, true) => Ok(()),
        (true, false) => Err("the valve is shut; then the page on fast interlocks is wrong about kill".into()),
    }
}
