//! Checks of the `rppal` driver on a simulated Raspberry Pi.
//!
//! Runs as root in a virtual machine with the kernel's module gpio-sim, and with nothing else in it: it mounts over parts
//! of /proc and /sys and makes a device file. What stands for the board:
//!
//! | of the board | here |
//! |---|---|
//! | its name in /proc/cpuinfo | a file mounted over it |
//! | registers, /dev/gpiomem | a file; set and clear bits are only remembered, levels are what a check writes |
//! | the pins' chip | gpio-sim with the label of the Raspberry Pi's chip |
//! | PWM channels in /sys/class/pwm | a folder of plain files mounted over it |
//!
//! Prints `ok NAME` or `FAILED NAME: why` per check and `N checks, M failed` at the end; exit code 1 when one failed.

mod alloc;
mod bench;
mod checks;
mod pi;

use pi::Pi;
use std::process::ExitCode;

/// One check: what it shows, and how.
type Check = (&'static str, fn(&Pi) -> Result<(), String>);

fn main() -> ExitCode {
    if !std::path::Path::new("/sys/kernel/config/gpio-sim").exists() {
        eprintln!(
            "no /sys/kernel/config/gpio-sim: run this as root in a virtual machine with the modules configfs and gpio-sim \
             and configfs mounted; it must not run on a machine that is used for anything else"
        );
        return ExitCode::from(2);
    }
    let mut tally = Tally::default();
    // Its order counts: a machine becomes a board piece by piece.
    tally.take("on a machine that is no board it refuses once", checks::refusals::no_board());
    let pi = match checks::refusals::board_comes() {
        Ok(pi) => {
            tally.take("a chip that comes later is found", Ok(()));
            pi
        }
        Err(why) => {
            tally.take("a chip that comes later is found", Err(why));
            return tally.end();
        }
    };
    for (name, check) in checks::ALL {
        tally.take(name, check(&pi));
    }
    tally.end()
}

#[derive(Default)]
struct Tally {
    checks: u32,
    failed: u32,
}

impl Tally {
    fn take(&mut self, name: &str, result: Result<(), String>) {
        self.checks += 1;
        match result {
            Ok(()) => println!("ok {name}"),
            Err(why) => {
                self.failed += 1;
                println!("FAILED {name}: {why}");
            }
        }
    }

    fn end(&self) -> ExitCode {
        println!("{} checks, {} failed", self.checks, self.failed);
        ExitCode::from(u8::from(self.failed > 0))
    }
}
