//! CPC's process control object (PCO): a unit of the plant that is run, in one of up to eight option modes, and commands
//! the objects that depend on it.

use super::{
    InterlockCommands, InterlockInputs, Interlocks, Mode, ModeInputs, OrderCommands, Orders, RestartRule, orders::Stop,
};
use crate::{Refusal, refusal};

/// Number of option modes.
const OPTION_MODES: u8 = 8;

/// Settings of the unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PcoSettings {
    /// For each option mode, those it may be left for: bit 0 is mode 1 (POpMoTab).
    pub allowed: [u8; OPTION_MODES as usize],
    /// Option mode at a cold start, 1 to 8.
    pub start_mode: u8,
    /// What it takes to start again after a full stop.
    pub full_stop_restart: RestartRule,
    /// After a cold start a full stop stands.
    pub full_stop_at_start: bool,
}

impl Default for PcoSettings {
    fn default() -> Self {
        Self {
            allowed: [u8::MAX; OPTION_MODES as usize],
            start_mode: 1,
            full_stop_restart: RestartRule::Acknowledge,
            full_stop_at_start: false,
        }
    }
}

impl PcoSettings {
    /// Refuses an option mode that there is not.
    pub fn check(&self) -> Result<(), Refusal> {
        let there = (1..=OPTION_MODES).contains(&self.start_mode);
        refusal::whole(there, "start-mode", self.start_mode.into(), "1 to 8")
    }

    fn allows(&self, from: u8, to: u8) -> bool {
        (1..=OPTION_MODES).contains(&to)
            && self.allowed.get(usize::from(from.wrapping_sub(1))).is_some_and(|mask| mask & bit(to) != 0)
    }
}

/// The bit of an option mode, 0 for none.
fn bit(mode: u8) -> u8 {
    if (1..=OPTION_MODES).contains(&mode) { 1 << (mode - 1) } else { 0 }
}

/// What acts on the unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PcoInputs {
    /// The first execution after a cold start.
    pub first: bool,
    /// What the plant's logic, or the unit this one depends on, wants.
    pub auto: ModeInputs,
    /// Option mode the logic wants, 1 to 8; 0 is none in particular (AuOpMoR).
    pub auto_option_mode: u8,
    /// A rising edge commands the dependents to auto mode (AuDepOR).
    pub auto_dependents: bool,
    /// The interlocks.
    pub interlocks: InterlockInputs,
    /// Something in the unit is in error.
    pub io_error: bool,
    /// Something in the unit is simulated.
    pub simulated: bool,
}

/// What an operator may do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PcoCommands {
    /// Modes and orders.
    pub orders: OrderCommands,
    /// Acknowledgement and restart.
    pub interlocks: InterlockCommands,
    /// Option modes, in manual and forced mode: bit 0 is mode 1. Of several the lowest is taken.
    pub option_modes: u8,
    /// Command the dependents to auto mode.
    pub dependents_auto: bool,
}

/// What the unit does and shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PcoOutputs {
    /// The unit is to run (RunOSt).
    pub run: bool,
    /// An interlock keeps it stopped.
    pub interlocked: bool,
    /// The option mode, 1 to 8.
    pub option_mode: u8,
    /// The same as one bit: bit 0 is mode 1.
    pub mode: u8,
    /// True for one execution: the dependents go to auto mode (AuDepOSt).
    pub dependents_auto: bool,
    /// The status register.
    pub status: PcoStatus,
}

/// The status register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PcoStatus {
    /// The unit is to run (RunOSt).
    pub run: bool,
    /// In auto mode (AuMoSt).
    pub auto_mode: bool,
    /// In manual mode (MMoSt).
    pub manual_mode: bool,
    /// In forced mode (FoMoSt).
    pub forced_mode: bool,
    /// The order of the logic (AuOnRSt).
    pub auto_order: bool,
    /// The order of the operator (MOnRSt).
    pub manual_order: bool,
    /// The logic orders something else than the operator (AuMRW).
    pub orders_differ: bool,
    /// An interlock keeps it stopped.
    pub interlocked: bool,
    /// The start interlock is there (StartISt).
    pub start_interlock: bool,
    /// The temporary stop is there (TStopISt).
    pub temporary_stop: bool,
    /// A full stop stands (FuStopISt).
    pub full_stop: bool,
    /// The restart must be allowed after a full stop (not EnRstartSt).
    pub restart_needed: bool,
    /// Something came and has not been acknowledged (AlUnAck).
    pub unacknowledged: bool,
    /// Something in the unit is in error (IOErrorW).
    pub io_error: bool,
    /// Something in the unit is simulated (IOSimuW).
    pub simulated: bool,
    /// The last wanted option mode is none that the present one may be left for.
    pub option_mode_refused: bool,
    /// The option mode as one bit: bit 0 is mode 1 (OpMoSt).
    pub mode: u8,
}

/// The unit. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pco {
    /// Mode and orders.
    pub orders: Orders,
    /// The interlocks.
    pub interlocks: Interlocks,
    /// The unit runs.
    pub run: bool,
    /// The option mode; 0 before the first execution.
    pub option_mode: u8,
    /// The last wanted option mode was refused.
    pub refused: bool,
    /// `auto_dependents` of the last execution.
    pub auto_dependents: bool,
}

impl Pco {
    /// One execution. Whatever the mode, an interlock wins over every order.
    pub fn execute(&mut self, settings: &PcoSettings, inputs: PcoInputs, commands: PcoCommands) -> PcoOutputs {
        self.orders.choose(false, &inputs.auto, &commands.orders);
        let before = self.interlocks.full_stop();
        let stopped = inputs.first && settings.full_stop_at_start;
        let rule = settings.full_stop_restart;
        let came = self.interlocks.execute(rule, stopped, inputs.interlocks, commands.interlocks);
        self.interlocks.acknowledge(came, commands.interlocks.acknowledge);
        let full_stop = self.interlocks.full_stop();
        let stop = Stop { before, now: full_stop, fail_safe: false };
        let order = self.orders.order(None, &inputs.auto, &commands.orders, stop);
        let interlocked = self.interlocks.forbid(self.run);
        self.run = order && !interlocked;
        self.choose_option(settings, &inputs, &commands);
        let dependents_auto = commands.dependents_auto || (inputs.auto_dependents && !self.auto_dependents);
        self.auto_dependents = inputs.auto_dependents;

        let mode = bit(self.option_mode);
        let status = PcoStatus {
            run: self.run,
            auto_mode: self.orders.mode == Mode::Auto,
            manual_mode: self.orders.mode == Mode::Manual,
            forced_mode: self.orders.mode == Mode::Forced,
            auto_order: self.orders.auto,
            manual_order: self.orders.manual,
            orders_differ: self.orders.auto != self.orders.manual,
            interlocked,
            start_interlock: inputs.interlocks.start,
            temporary_stop: inputs.interlocks.temporary,
            full_stop,
            restart_needed: self.interlocks.restart_needed,
            unacknowledged: self.interlocks.unacknowledged,
            io_error: inputs.io_error,
            simulated: inputs.simulated,
            option_mode_refused: self.refused,
            mode,
        };
        PcoOutputs { run: self.run, interlocked, option_mode: self.option_mode, mode, dependents_auto, status }
    }

    /// A refusal stays visible until another option mode is wanted, or in auto mode none any more.
    fn choose_option(&mut self, settings: &PcoSettings, inputs: &PcoInputs, commands: &PcoCommands) {
        if bit(self.option_mode) == 0 {
            // Settings that `check` accepts name a mode that there is.
            self.option_mode = settings.start_mode.clamp(1, OPTION_MODES);
        }
        let auto = self.orders.mode == Mode::Auto;
        let wanted = match commands.option_modes {
            _ if auto => inputs.auto_option_mode,
            0 => 0,
            several => several.trailing_zeros() as u8 + 1,
        };
        if wanted == 0 {
            self.refused &= !auto;
        } else if wanted == self.option_mode || settings.allows(self.option_mode, wanted) {
            (self.option_mode, self.refused) = (wanted, false);
        } else {
            self.refused = true;
        }
    }
}
