//! CPC's DigitalInput (DI): a binary signal of the field, its quality, and an operator's hold on it.

use super::{Binary, Force, ForceCommands};
use crate::Quality;

/// Settings of the input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalInputSettings {
    /// The position is the inverse of the raw signal.
    pub inverted: bool,
}

/// What can be seen of the input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalInputOutputs {
    /// The position; good while forced, otherwise with the quality of the raw signal.
    pub position: Binary,
    /// The status register.
    pub status: DigitalInputStatus,
}

/// The status register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalInputStatus {
    /// The position (PosSt).
    pub position: bool,
    /// It follows the operator (FoMoSt).
    pub forced: bool,
    /// The raw signal is bad (IOErrorW).
    pub io_error: bool,
    /// The raw signal is simulated (IOSimuW).
    pub simulated: bool,
    /// What the position would be if it were not forced (HFPos).
    pub measured: bool,
    /// Forced to something else than what is measured (FoDiProW).
    pub forced_differs: bool,
}

/// The input. The field is the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalInput {
    /// The operator's hold.
    pub force: Force,
}

impl DigitalInput {
    /// One execution.
    pub fn execute(
        &mut self,
        settings: &DigitalInputSettings,
        raw: Binary,
        simulated: bool,
        commands: ForceCommands,
    ) -> DigitalInputOutputs {
        let measured = raw.value != settings.inverted;
        let forced = self.force.execute(commands);
        let value = forced.unwrap_or(measured);
        let quality = if forced.is_some() { Quality::Good } else { raw.quality };
        let status = DigitalInputStatus {
            position: value,
            forced: forced.is_some(),
            io_error: raw.is_bad(),
            simulated,
            measured,
            forced_differs: value != measured,
        };
        DigitalInputOutputs { position: Binary::new(value, quality), status }
    }
}
