//! What outputs show when the plant ends, and when the chip goes away.

use crate::Done;
use crate::chip::Chip;
use crate::field::{LEVEL, ON, OUTPUTS, PUMP, VACUUM, VALVE, running, started, well};
use crate::run::{Run, told, until};
use rustix::process::Signal;

pub(crate) fn replugged(chip: &mut Chip) -> Done {
    // By its label: it comes back under another path.
    let run = Run::start("latchwork-field", None)?;
    // Two parts of the plant use the chip, the interrupt lane and the driver's own cycle.
    let (connected, lost) = (|| told("gpio", "connected").len(), || told("gpio", "lost").len());
    started(chip)?;
    until("the valve and the pump run", || chip.value(VALVE) && chip.value(PUMP))?;
    chip.unplug();
    until("both parts record the loss", || lost() == 2)?;
    chip.plug().map_err(|e| format!("the chip did not come back: {e}"))?;
    until("both parts have the chip again", || connected() == 4)?;
    // A line that is opened is pulled up by its bias.
    well(chip);
    until("the valve and the pump run again", || chip.value(VALVE) && chip.value(PUMP))?;
    let before = told("gpio.vacuum", "falling").len();
    chip.pull(VACUUM, true);
    until("edges are recorded again", || told("gpio.vacuum", "falling").len() > before)?;
    until("outputs of the interrupt lane follow again", || !chip.value(VALVE))?;
    chip.pull(LEVEL, true);
    until("outputs of the main lane follow again", || !chip.value(PUMP))?;
    if (connected(), lost()) != (4, 2) {
        return Err(format!("{} times connected, {} times lost", connected(), lost()));
    }
    run.end(Signal::TERM).map(drop)
}

/// What the lines show after a signal, while their requests are kept open by duplicates.
pub(crate) fn ended(chip: &mut Chip, signal: Signal) -> Done {
    let run = running(chip)?;
    let lines = run.hold_lines()?;
    let status = run.end(signal)?;
    let on: Vec<&str> = OUTPUTS.iter().filter(|(_, line)| chip.value(*line)).map(|(name, _)| *name).collect();
    drop(lines);
    if signal == Signal::KILL {
        // Documented: a kill leaves nobody to write the safe values.
        let were: Vec<&str> = ON.iter().map(|(name, _)| *name).collect();
        return match on == were {
            true => Ok(()),
            false => Err(format!("on are {on:?}, and were {were:?}: the page on fast interlocks is wrong about kill")),
        };
    }
    match (on.is_empty(), status.success()) {
        (true, true) => Ok(()),
        (true, false) => Err(format!("latchwork ended with {status}")),
        (false, _) => Err(format!("still on: {on:?}")),
    }
}
