//! The lines of the example, and a plant that runs with everything well.

use crate::chip::Chip;
use crate::run::{Run, told, until, within};
use std::time::Duration;

pub(crate) const DOOR: usize = 17;
pub(crate) const BEAM: usize = 27;
pub(crate) const VACUUM: usize = 22;
pub(crate) const LEVEL: usize = 23;
const INPUTS: [usize; 6] = [DOOR, BEAM, VACUUM, LEVEL, 24, 25];

pub(crate) const SHUTTER: usize = 5;
pub(crate) const SOURCE: usize = 6;
pub(crate) const VALVE: usize = 13;
pub(crate) const PUMP: usize = 16;
pub(crate) const DRYER: usize = 20;
const HEATER: usize = 21;

/// Outputs that are on while all is well. The heater is off: it has its own mode of the unit.
pub(crate) const ON: [(&str, usize); 5] =
    [("shutter", SHUTTER), ("source", SOURCE), ("valve", VALVE), ("pump", PUMP), ("dryer", DRYER)];
pub(crate) const OUTPUTS: [(&str, usize); 6] = [ON[0], ON[1], ON[2], ON[3], ON[4], ("heater", HEATER)];

/// All is well: contacts closed, which is low at the line.
pub(crate) fn well(chip: &Chip) {
    INPUTS.iter().for_each(|line| chip.pull(*line, false));
}

/// Both lanes have begun, and hold the lines: a line that is opened is pulled up by its bias, so it is pulled down after that.
pub(crate) fn started(chip: &Chip) -> Result<(), String> {
    // The first time the components are compiled, which takes a machine that is emulated its time.
    within(Duration::from_secs(150), "both lanes run", || {
        told("lane.trip", "started").len() == 1 && told("lane.main", "started").len() == 1
    })?;
    until("all lines are open", || told("gpio", "connected").len() == 2)?;
    well(chip);
    Ok(())
}

/// A plant that runs with everything well and its actuators on.
pub(crate) fn running(chip: &Chip) -> Result<Run, String> {
    let run = Run::start(&chip.path(), None)?;
    started(chip)?;
    for (name, line) in ON {
        until(&format!("{name} is on"), || chip.value(line))?;
    }
    Ok(run)
}
