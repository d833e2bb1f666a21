//! Veracity checks: whether a signal is to be believed (alarm unit, chapter 2).

mod analog;
mod digital;

pub use analog::{AnalogSettings, AnalogState, AnalogVeracity};
pub use digital::{DigitalState, DigitalVeracity};
