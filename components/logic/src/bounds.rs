//! Bounds check with hysteresis (alarm unit, chapter 4).

use crate::{Refusal, Rs, refusal};

/// Settings of the check, all in the signal's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundsSettings {
    /// Low limit; finite, below `high_limit`.
    pub low_limit: f64,
    /// High limit; finite, above `low_limit`.
    pub high_limit: f64,
    /// Hysteresis of both limits; finite, 0 or more.
    pub hysteresis: f64,
}

impl Default for BoundsSettings {
    fn default() -> Self {
        Self { low_limit: 10.0, high_limit: 50.0, hysteresis: 1.0 }
    }
}

impl BoundsSettings {
    /// Refuses limits that are no numbers or the wrong way round, and a negative hysteresis.
    pub fn check(&self) -> Result<(), Refusal> {
        refusal::finite("low-limit", self.low_limit)?;
        refusal::finite("high-limit", self.high_limit)?;
        if self.low_limit >= self.high_limit {
            let (low, high) = (("low-limit", self.low_limit), ("high-limit", self.high_limit));
            return Err(Refusal::related(low, "below", high));
        }
        refusal::not_negative("hysteresis", self.hysteresis)
    }
}

/// The check: two flip-flops. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoundsCheck {
    /// The signal went above the high limit and has not come back by more than the hysteresis.
    pub high: Rs,
    /// The signal went below the low limit and has not come back by more than the hysteresis.
    pub low: Rs,
}

impl BoundsCheck {
    /// One execution; returns whether the signal is NaN, which changes nothing.
    ///
    /// Beyond one limit, the other flip-flop is reset whatever the hysteresis: one wider than the distance of the limits
    /// would otherwise leave a signal too high and too low at once.
    pub fn execute(&mut self, settings: &BoundsSettings, signal: f64) -> bool {
        if signal.is_nan() {
            return true;
        }
        let BoundsSettings { low_limit, high_limit, hysteresis } = *settings;
        let (above, below) = (signal > high_limit, signal < low_limit);
        self.high.execute(above, below || signal < high_limit - hysteresis);
        self.low.execute(below && !above, above || signal > low_limit + hysteresis);
        false
    }
}
