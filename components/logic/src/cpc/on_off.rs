//! CPC's OnOff: an actuator with two positions, its modes, interlocks and feedbacks.

use super::{
    InterlockCommands, InterlockInputs, Interlocks, Mode, ModeInputs, OrderCommands, Orders, RestartRule, Supervision,
    orders::Stop,
};
use crate::{Refusal, refusal};

/// Settings of the actuator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OnOffSettings {
    /// The fail-safe position is on (PFsPosOn).
    pub fail_safe_on: bool,
    /// There is a feedback of on (PHFOn).
    pub has_feedback_on: bool,
    /// There is a feedback of off (PHFOff).
    pub has_feedback_off: bool,
    /// How long the feedbacks may take to follow, ns; above 0 (PWDt).
    pub feedback_timeout: u64,
    /// What it takes to start again after a full stop.
    pub full_stop_restart: RestartRule,
    /// After a cold start a full stop stands.
    pub full_stop_at_start: bool,
}

impl Default for OnOffSettings {
    fn default() -> Self {
        Self {
            fail_safe_on: false,
            has_feedback_on: false,
            has_feedback_off: false,
            feedback_timeout: 10_000_000_000,
            full_stop_restart: RestartRule::Acknowledge,
            full_stop_at_start: false,
        }
    }
}

impl OnOffSettings {
    /// Refuses a time-out of 0.
    pub fn check(&self) -> Result<(), Refusal> {
        refusal::some_time("feedback-timeout", self.feedback_timeout)
    }
}

/// What acts on the actuator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OnOffInputs {
    /// The first execution after a cold start.
    pub first: bool,
    /// What the plant's logic wants.
    pub auto: ModeInputs,
    /// The panel at the actuator has control (HLD).
    pub local: bool,
    /// On, from the local panel (HOnR).
    pub local_on: bool,
    /// Off, from the local panel; wins over `local_on` (HOffR).
    pub local_off: bool,
    /// The actuator is on (HFOn).
    pub feedback_on: bool,
    /// The actuator is off (HFOff).
    pub feedback_off: bool,
    /// The interlocks.
    pub interlocks: InterlockInputs,
    /// An input or output of the actuator is in error.
    pub io_error: bool,
    /// An input or output of the actuator is simulated.
    pub simulated: bool,
}

/// What the actuator does and shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OnOffOutputs {
    /// To the field.
    pub output: bool,
    /// The actuator is on, as far as the feedbacks say.
    pub on: bool,
    /// The actuator is off, as far as the feedbacks say.
    pub off: bool,
    /// An interlock keeps it in its fail-safe position.
    pub interlocked: bool,
    /// The status register.
    pub status: OnOffStatus,
}

/// The status register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OnOffStatus {
    /// On (OnSt).
    pub on: bool,
    /// Off (OffSt).
    pub off: bool,
    /// The output (OutOnOVSt).
    pub output: bool,
    /// In auto mode (AuMoSt).
    pub auto_mode: bool,
    /// In manual mode (MMoSt).
    pub manual_mode: bool,
    /// In forced mode (FoMoSt).
    pub forced_mode: bool,
    /// In local mode (LDSt).
    pub local_mode: bool,
    /// The order of the logic (AuOnRSt).
    pub auto_order: bool,
    /// The order of the operator or of the local panel (MOnRSt).
    pub manual_order: bool,
    /// The logic orders something else than the operator or the local panel (AuMRW).
    pub orders_differ: bool,
    /// An interlock keeps it in its fail-safe position.
    pub interlocked: bool,
    /// The start interlock is there (StartISt).
    pub start_interlock: bool,
    /// The temporary stop is there (TStopISt).
    pub temporary_stop: bool,
    /// A full stop stands (FuStopISt).
    pub full_stop: bool,
    /// The restart must be allowed after a full stop (not EnRstartSt).
    pub restart_needed: bool,
    /// The feedbacks differ from the output, within their time.
    pub moving: bool,
    /// The feedbacks have differed from the output for too long (PosW).
    pub position_alarm: bool,
    /// Something came and has not been acknowledged (AlUnAck).
    pub unacknowledged: bool,
    /// An input or output is in error (IOErrorW).
    pub io_error: bool,
    /// An input or output is simulated (IOSimuW).
    pub simulated: bool,
}

/// The actuator. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OnOff {
    /// Mode and orders.
    pub orders: Orders,
    /// The interlocks.
    pub interlocks: Interlocks,
    /// The output is out of its fail-safe position.
    pub started: bool,
    /// Whether the feedbacks follow.
    pub feedback: Supervision,
    /// The position alarm of the last execution.
    pub position_alarm: bool,
}

impl OnOff {
    /// One execution, `elapsed` ns after the previous one. Whatever the mode, an interlock wins over every order.
    pub fn execute(
        &mut self,
        settings: &OnOffSettings,
        elapsed: u64,
        inputs: OnOffInputs,
        commands: OrderCommands,
        interlock_commands: InterlockCommands,
    ) -> OnOffOutputs {
        let fail_safe = settings.fail_safe_on;
        if inputs.first {
            self.orders.begin(fail_safe);
        }
        self.orders.choose(inputs.local, &inputs.auto, &commands);
        let before = self.interlocks.full_stop();
        let stopped = inputs.first && settings.full_stop_at_start;
        let came = self.interlocks.execute(settings.full_stop_restart, stopped, inputs.interlocks, interlock_commands);
        let full_stop = self.interlocks.full_stop();
        let local = inputs.local.then_some((inputs.local_on, inputs.local_off));
        let order = self.orders.order(local, &inputs.auto, &commands, Stop { before, now: full_stop, fail_safe });
        let interlocked = self.interlocks.forbid(self.started);
        let output = if interlocked { fail_safe } else { order };
        self.started = output != fail_safe;

        let is_on = settings.has_feedback_on.then_some(inputs.feedback_on);
        let is_off = settings.has_feedback_off.then_some(inputs.feedback_off);
        let differs = is_on.is_some_and(|on| on != output) || is_off.is_some_and(|off| off == output);
        let position_alarm = self.feedback.execute(elapsed, output, differs, settings.feedback_timeout);
        let came = came || (position_alarm && !self.position_alarm);
        self.position_alarm = position_alarm;
        self.interlocks.acknowledge(came, interlock_commands.acknowledge);

        let on = is_on.or(is_off.map(|off| !off)).unwrap_or(output);
        let off = is_off.or(is_on.map(|on| !on)).unwrap_or(!output);
        let remote = |mode| !inputs.local && self.orders.mode == mode;
        let status = OnOffStatus {
            on,
            off,
            output,
            auto_mode: remote(Mode::Auto),
            manual_mode: remote(Mode::Manual),
            forced_mode: remote(Mode::Forced),
            local_mode: inputs.local,
            auto_order: self.orders.auto,
            manual_order: self.orders.manual,
            orders_differ: self.orders.auto != self.orders.manual,
            interlocked,
            start_interlock: inputs.interlocks.start,
            temporary_stop: inputs.interlocks.temporary,
            full_stop,
            restart_needed: self.interlocks.restart_needed,
            moving: differs && !position_alarm,
            position_alarm,
            unacknowledged: self.interlocks.unacknowledged,
            io_error: inputs.io_error,
            simulated: inputs.simulated,
        };
        OnOffOutputs { output, on, off, interlocked, status }
    }
}
