//! Outputs follow their inputs: those of the interrupt lane at once, whatever the main lane waits for.

use crate::Done;
use crate::chip::Chip;
use crate::field::{BEAM, DOOR, LEVEL, ON, PUMP, SHUTTER, SOURCE, VACUUM, VALVE, started};
use crate::run::{Run, until, within};
use rustix::process::Signal;
use std::time::Duration;

/// Period of the main lane here: a reaction that waits for it takes half of this on average.
const MAIN: &str = "2s";
/// Longest time an interrupt lane may take; a small machine emulates this one, and it has other work.
const FAST: Duration = Duration::from_secs(1);
const VALVES: usize = 100;
const TRIPS: usize = 3;

pub(crate) fn follow(chip: &mut Chip) -> Done {
    let run = Run::start(&chip.path(), Some(MAIN))?;
    started(chip)?;
    for (name, line) in ON {
        until(&format!("{name} is on"), || chip.value(line))?;
    }
    for n in 0..VALVES {
        let well = n % 2 == 1;
        chip.pull(VACUUM, !well);
        within(FAST, "the valve follows the vacuum", || chip.value(VALVE) == well)?;
    }
    for _ in 0..TRIPS {
        // Neither outruns the other.
        chip.pull(DOOR, true);
        chip.pull(BEAM, true);
        within(FAST, "the shutter closes with the door open", || !chip.value(SHUTTER))?;
        within(FAST, "the source is off without beam", || !chip.value(SOURCE))?;
        chip.pull(DOOR, false);
        chip.pull(BEAM, false);
        // They come back after an acknowledgement, which the main lane brings.
        until("shutter and source come back", || chip.value(SHUTTER) && chip.value(SOURCE))?;
    }
    chip.pull(LEVEL, true);
    until("the pump stops without water", || !chip.value(PUMP))?;
    chip.pull(LEVEL, false);
    until("the pump comes back", || chip.value(PUMP))?;
    run.end(Signal::TERM).map(drop)
}
