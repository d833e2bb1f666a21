//! The objects of UNICOS CPC (CERN's Continuous Process Control package, version 6): inputs and outputs, alarms, an
//! actuator and a process unit.
//!
//! ```text
//! raw ─► DigitalInput ─► DigitalAlarm ─┬─► Pco ──► OnOff ─► DigitalOutput ─► field
//! raw ─► AnalogInput ──► AnalogAlarm ──┘ (interlocks)       AnalogOutput
//! ```
//!
//! What they share stands in modules of its own: an operator's hold on a binary position (`force`), who orders (`orders`),
//! what forbids to follow an order (`interlock`), whether the field follows (`supervision`). Every object answers with a
//! status whose fields are the bits of CPC's status register, under names in words.
//!
//! In all of them an occurrence and an acknowledgement in the same execution leave the occurrence unacknowledged.

mod analog_alarm;
mod analog_input;
mod analog_output;
mod digital_alarm;
mod digital_input;
mod digital_output;
mod force;
mod interlock;
mod on_off;
mod orders;
mod pco;
mod range;
mod supervision;

pub use analog_alarm::{
    AnalogAlarm, AnalogAlarmInputs, AnalogAlarmOutputs, AnalogAlarmSettings, AnalogAlarmStatus, Threshold, Thresholds,
};
pub use analog_input::{AnalogInput, AnalogInputOutputs, AnalogInputSettings, AnalogInputStatus};
pub use analog_output::{
    AnalogOutput, AnalogOutputInputs, AnalogOutputOutputs, AnalogOutputSettings, AnalogOutputStatus,
};
pub use digital_alarm::{
    AlarmCommands, DigitalAlarm, DigitalAlarmInputs, DigitalAlarmOutputs, DigitalAlarmSettings, DigitalAlarmStatus,
};
pub use digital_input::{DigitalInput, DigitalInputOutputs, DigitalInputSettings, DigitalInputStatus};
pub use digital_output::{
    DigitalOutput, DigitalOutputInputs, DigitalOutputOutputs, DigitalOutputSettings, DigitalOutputStatus,
};
pub use force::{AnalogForce, AnalogForceCommands, Force, ForceCommands};
pub use interlock::{InterlockCommands, InterlockInputs, Interlocks, RestartRule};
pub use on_off::{OnOff, OnOffInputs, OnOffOutputs, OnOffSettings, OnOffStatus};
pub use orders::{Mode, ModeInputs, OrderCommands, Orders};
pub use pco::{Pco, PcoCommands, PcoInputs, PcoOutputs, PcoSettings, PcoStatus};
pub use supervision::Supervision;

use crate::Quality;

/// A binary value and its quality.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Binary {
    /// The value.
    pub value: bool,
    /// How far the value can be trusted.
    pub quality: Quality,
}

impl Binary {
    /// A value with its quality.
    #[must_use]
    pub const fn new(value: bool, quality: Quality) -> Self {
        Self { value, quality }
    }

    /// Whether the value is an I/O error: not to be used.
    pub(crate) fn is_bad(self) -> bool {
        self.quality == Quality::Bad
    }
}
