//! CPC's AnalogAlarm (AA): a value and up to four thresholds. HH and LL give an interlock, H and L warn.

use super::AlarmCommands;
use crate::{Refusal, Signal, Ton, refusal};

/// One thing per threshold, from the highest to the lowest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Thresholds<T> {
    /// High high: alarm and interlock.
    pub hh: T,
    /// High: warning.
    pub h: T,
    /// Low: warning.
    pub l: T,
    /// Low low: alarm and interlock.
    pub ll: T,
}

impl<T: Copy> Thresholds<T> {
    /// The same for each threshold.
    pub const fn all(value: T) -> Self {
        Self { hh: value, h: value, l: value, ll: value }
    }

    fn zip<U: Copy, V>(self, other: Thresholds<U>, mut with: impl FnMut(T, U) -> V) -> Thresholds<V> {
        Thresholds {
            hh: with(self.hh, other.hh),
            h: with(self.h, other.h),
            l: with(self.l, other.l),
            ll: with(self.ll, other.ll),
        }
    }
}

impl Thresholds<bool> {
    fn any(self) -> bool {
        self.hh || self.h || self.l || self.ll
    }
}

/// Settings of the alarm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalogAlarmSettings {
    /// The limits, in the unit of the value; those that are used are finite and rise from LL to HH.
    pub limits: Thresholds<f64>,
    /// Which thresholds are used.
    pub used: Thresholds<bool>,
    /// How far the value must come back from a limit, in its unit; finite, 0 or more, at most the distance between the
    /// lower and the upper limits.
    pub hysteresis: f64,
    /// How long the value must lie beyond a limit, ns; 0 is at once.
    pub delay: u64,
    /// A value that cannot be read gives the interlock, where HH or LL would.
    pub interlock_on_io_error: bool,
}

impl Default for AnalogAlarmSettings {
    fn default() -> Self {
        Self {
            limits: Thresholds { hh: 90.0, h: 80.0, l: 20.0, ll: 10.0 },
            used: Thresholds::all(true),
            hysteresis: 1.0,
            delay: 0,
            interlock_on_io_error: true,
        }
    }
}

impl AnalogAlarmSettings {
    /// Refuses limits that are no numbers or not in their order, and a hysteresis that would reach across.
    pub fn check(&self) -> Result<(), Refusal> {
        let (limits, used) = (self.limits, self.used);
        let rising =
            [("ll", limits.ll, used.ll), ("l", limits.l, used.l), ("h", limits.h, used.h), ("hh", limits.hh, used.hh)];
        let mut below: Option<(&str, f64)> = None;
        for (name, value, _) in rising.into_iter().filter(|(_, _, used)| *used) {
            refusal::finite(name, value)?;
            if let Some(below) = below.filter(|(_, b)| value <= *b) {
                return Err(Refusal::related((name, value), "above", below));
            }
            below = Some((name, value));
        }
        refusal::not_negative("hysteresis", self.hysteresis)?;
        let (lower, upper) = rising.split_at(2);
        let (lower, upper) = (lower.iter().rfind(|(_, _, used)| *used), upper.iter().find(|(_, _, used)| *used));
        if let (Some((_, lower, _)), Some((_, upper, _))) = (lower, upper) {
            let distance = upper - lower;
            if self.hysteresis > distance {
                let distance = ("the lower and the upper limits,", distance);
                return Err(Refusal::related(("hysteresis", self.hysteresis), "at most the distance of", distance));
            }
        }
        Ok(())
    }
}

/// What acts on the alarm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnalogAlarmInputs {
    /// The value.
    pub value: Signal,
    /// Thresholds that count for nothing; a running delay is forgotten, and that the value was beyond.
    pub disable: Thresholds<bool>,
    /// Occurrences need no acknowledgement.
    pub auto_acknowledge: bool,
    /// The value is simulated.
    pub simulated: bool,
}

/// What the alarm does and shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AnalogAlarmOutputs {
    /// HH or LL stands, or the value cannot be read, and it is not blocked: to the interlocks of an object.
    pub interlock: bool,
    /// H or L stands and it is not blocked.
    pub warning: bool,
    /// What the operator is told: the thresholds that stand and are not blocked.
    pub alarms: Thresholds<bool>,
    /// The status register.
    pub status: AnalogAlarmStatus,
}

/// The status register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AnalogAlarmStatus {
    /// The thresholds that stand, blocked or not (HHSt, HSt, LSt, LLSt).
    pub active: Thresholds<bool>,
    /// The thresholds that are used and not disabled.
    pub enabled: Thresholds<bool>,
    /// A delay runs.
    pub pending: bool,
    /// HH, LL or an I/O error interlocks (ISt).
    pub interlock: bool,
    /// H or L warns (WSt).
    pub warning: bool,
    /// Not acknowledged since the last occurrence (AlUnAck).
    pub unacknowledged: bool,
    /// Masked by the operator (MAlBRSt).
    pub blocked: bool,
    /// The value cannot be read (IOErrorW).
    pub io_error: bool,
    /// The value is simulated (IOSimuW).
    pub simulated: bool,
}

/// The state of one threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Threshold {
    /// While enabled, the value went beyond the limit and has not come back by the hysteresis.
    pub beyond: bool,
    /// Condition and delay.
    pub delay: Ton,
}

/// The alarm. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AnalogAlarm {
    /// The thresholds.
    pub thresholds: Thresholds<Threshold>,
    /// Condition and delay of the I/O error's interlock.
    pub io_error: Ton,
    /// What the operator was told in the last execution.
    pub alarms: Thresholds<bool>,
    /// The interlock of the last execution.
    pub interlock: bool,
    /// Masked by the operator.
    pub blocked: bool,
    /// Not acknowledged since the last occurrence.
    pub unacknowledged: bool,
}

impl AnalogAlarm {
    /// One execution, `elapsed` ns after the previous one. A value that cannot be read changes no threshold.
    pub fn execute(
        &mut self,
        settings: &AnalogAlarmSettings,
        elapsed: u64,
        inputs: AnalogAlarmInputs,
        commands: AlarmCommands,
    ) -> AnalogAlarmOutputs {
        let AnalogAlarmInputs { value, disable, auto_acknowledge, simulated } = inputs;
        let io_error = !value.is_usable();
        if !io_error {
            self.compare(settings, value.value);
        }
        let enabled = settings.used.zip(disable, |used, disable| used && !disable);
        self.forget(enabled);
        let mut pending = false;
        let mut delayed = |ton: &mut Ton, condition: bool| {
            let active = ton.execute(elapsed, condition, settings.delay);
            pending |= condition && !active;
            active
        };
        let t = &mut self.thresholds;
        let active = Thresholds {
            hh: delayed(&mut t.hh.delay, t.hh.beyond),
            h: delayed(&mut t.h.delay, t.h.beyond),
            l: delayed(&mut t.l.delay, t.l.beyond),
            ll: delayed(&mut t.ll.delay, t.ll.beyond),
        };
        let unseen = io_error && settings.interlock_on_io_error && (enabled.hh || enabled.ll);
        let unseen = delayed(&mut self.io_error, unseen);
        self.blocked = commands.blocked(self.blocked);
        let alarms = active.zip(Thresholds::all(!self.blocked), |active, shown| active && shown);
        let interlock = alarms.hh || alarms.ll || (unseen && !self.blocked);
        let warning = alarms.h || alarms.l;
        let occurred = alarms.zip(self.alarms, |now, before| now && !before).any() || (interlock && !self.interlock);
        (self.alarms, self.interlock) = (alarms, interlock);
        self.unacknowledged = commands.unacknowledged(self.unacknowledged, occurred, auto_acknowledge);
        let status = AnalogAlarmStatus {
            active,
            enabled,
            pending,
            interlock,
            warning,
            unacknowledged: self.unacknowledged,
            blocked: self.blocked,
            io_error,
            simulated,
        };
        AnalogAlarmOutputs { interlock, warning, alarms, status }
    }

    /// A threshold that is not enabled forgets the hysteresis too: once enabled, it stands for a value beyond its limit alone.
    fn forget(&mut self, enabled: Thresholds<bool>) {
        let t = &mut self.thresholds;
        t.hh.beyond &= enabled.hh;
        t.h.beyond &= enabled.h;
        t.l.beyond &= enabled.l;
        t.ll.beyond &= enabled.ll;
    }

    fn compare(&mut self, settings: &AnalogAlarmSettings, value: f64) {
        let (limits, back) = (settings.limits, settings.hysteresis);
        let t = &mut self.thresholds;
        for (threshold, limit) in [(&mut t.hh, limits.hh), (&mut t.h, limits.h)] {
            threshold.beyond = value > limit || (threshold.beyond && value >= limit - back);
        }
        for (threshold, limit) in [(&mut t.l, limits.l), (&mut t.ll, limits.ll)] {
            threshold.beyond = value < limit || (threshold.beyond && value <= limit + back);
        }
    }
}
