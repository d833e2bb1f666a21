//! CPC's DigitalOutput (DO): a binary order to the field, an operator's hold on it, and whether it arrived.

use super::{Force, ForceCommands, Supervision};

/// Settings of the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DigitalOutputSettings {
    /// The output is the inverse of the position.
    pub inverted: bool,
    /// The output is read back.
    pub has_readback: bool,
    /// How long what is read back may differ, ns.
    pub mismatch_time: u64,
}

impl Default for DigitalOutputSettings {
    fn default() -> Self {
        Self { inverted: false, has_readback: false, mismatch_time: 500_000_000 }
    }
}

/// What acts on the output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalOutputInputs {
    /// The position that is wanted.
    pub order: bool,
    /// The output as the field has it.
    pub readback: bool,
    /// The channel reports an error.
    pub io_error: bool,
    /// The channel is simulated.
    pub simulated: bool,
}

/// What the output does and shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalOutputOutputs {
    /// To the field.
    pub output: bool,
    /// The status register.
    pub status: DigitalOutputStatus,
}

/// The status register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalOutputStatus {
    /// The position (PosSt).
    pub position: bool,
    /// It follows the operator (FoMoSt).
    pub forced: bool,
    /// The channel reports an error (IOErrorW).
    pub io_error: bool,
    /// The channel is simulated (IOSimuW).
    pub simulated: bool,
    /// The position that is wanted (AuPosRSt).
    pub order: bool,
    /// Forced to something else than what is wanted (FoDiProW).
    pub forced_differs: bool,
    /// What is read back has differed for too long.
    pub mismatch: bool,
}

/// The output. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalOutput {
    /// The operator's hold.
    pub force: Force,
    /// Whether what is read back follows.
    pub readback: Supervision,
}

impl DigitalOutput {
    /// One execution, `elapsed` ns after the previous one.
    pub fn execute(
        &mut self,
        settings: &DigitalOutputSettings,
        elapsed: u64,
        inputs: DigitalOutputInputs,
        commands: ForceCommands,
    ) -> DigitalOutputOutputs {
        let DigitalOutputInputs { order, readback, io_error, simulated } = inputs;
        let forced = self.force.execute(commands);
        let position = forced.unwrap_or(order);
        let output = position != settings.inverted;
        let differs = settings.has_readback && readback != output;
        let status = DigitalOutputStatus {
            position,
            forced: forced.is_some(),
            io_error,
            simulated,
            order,
            forced_differs: position != order,
            mismatch: self.readback.execute(elapsed, output, differs, settings.mismatch_time),
        };
        DigitalOutputOutputs { output, status }
    }
}
