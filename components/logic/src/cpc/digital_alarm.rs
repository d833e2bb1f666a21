//! CPC's DigitalAlarm (DA): a condition that becomes an alarm and an interlock after its delay.

use super::Binary;
use crate::Ton;

/// Settings of the alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DigitalAlarmSettings {
    /// How long the condition must stand, ns; 0 is at once.
    pub delay: u64,
    /// A condition that cannot be read counts as true.
    pub alarm_on_io_error: bool,
}

impl Default for DigitalAlarmSettings {
    fn default() -> Self {
        Self { delay: 0, alarm_on_io_error: true }
    }
}

/// What acts on the alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalAlarmInputs {
    /// The condition.
    pub input: Binary,
    /// The condition counts for nothing, and a running delay is forgotten.
    pub disable: bool,
    /// Occurrences need no acknowledgement.
    pub auto_acknowledge: bool,
    /// The condition is simulated.
    pub simulated: bool,
}

/// What an operator may do with an alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AlarmCommands {
    /// The operator has seen it.
    pub acknowledge: bool,
    /// Masks it: neither alarm nor interlock.
    pub block: bool,
    /// Ends that; wins over `block`.
    pub unblock: bool,
}

/// What the alarm does and shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalAlarmOutputs {
    /// The alarm stands and is not blocked: to the interlocks of an object, and the alarm for the operator.
    pub interlock: bool,
    /// The status register.
    pub status: DigitalAlarmStatus,
}

/// The status register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalAlarmStatus {
    /// The condition.
    pub input: bool,
    /// The condition stands, the delay runs.
    pub pending: bool,
    /// The condition has stood for the delay (ISt without the block).
    pub active: bool,
    /// Active and not blocked (ISt).
    pub interlock: bool,
    /// Not acknowledged since the last occurrence (AlUnAck).
    pub unacknowledged: bool,
    /// Masked by the operator (MAlBRSt).
    pub blocked: bool,
    /// Not disabled (EnSt).
    pub enabled: bool,
    /// The condition cannot be read (IOErrorW).
    pub io_error: bool,
    /// The condition is simulated (IOSimuW).
    pub simulated: bool,
}

/// The alarm. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DigitalAlarm {
    /// Condition and delay.
    pub delay: Ton,
    /// Masked by the operator.
    pub blocked: bool,
    /// The interlock of the last execution.
    pub interlock: bool,
    /// Not acknowledged since the last occurrence.
    pub unacknowledged: bool,
}

impl DigitalAlarm {
    /// One execution, `elapsed` ns after the previous one.
    pub fn execute(
        &mut self,
        settings: &DigitalAlarmSettings,
        elapsed: u64,
        inputs: DigitalAlarmInputs,
        commands: AlarmCommands,
    ) -> DigitalAlarmOutputs {
        let DigitalAlarmInputs { input, disable, auto_acknowledge, simulated } = inputs;
        let io_error = input.is_bad();
        let condition = input.value || (io_error && settings.alarm_on_io_error);
        let counts = condition && !disable;
        let active = self.delay.execute(elapsed, counts, settings.delay);
        self.blocked = commands.blocked(self.blocked);
        let interlock = active && !self.blocked;
        let occurred = interlock && !self.interlock;
        self.interlock = interlock;
        self.unacknowledged = commands.unacknowledged(self.unacknowledged, occurred, auto_acknowledge);
        let status = DigitalAlarmStatus {
            input: input.value,
            pending: counts && !active,
            active,
            interlock,
            unacknowledged: self.unacknowledged,
            blocked: self.blocked,
            enabled: !disable,
            io_error,
            simulated,
        };
        DigitalAlarmOutputs { interlock, status }
    }
}

impl AlarmCommands {
    /// Whether the alarm is blocked now.
    pub(super) fn blocked(self, before: bool) -> bool {
        !self.unblock && (self.block || before)
    }

    /// Whether it is unacknowledged now. An acknowledgement is for what was there before: it hides no new occurrence.
    pub(super) fn unacknowledged(self, before: bool, occurred: bool, auto: bool) -> bool {
        !auto && (occurred || (before && !self.acknowledge))
    }
}
