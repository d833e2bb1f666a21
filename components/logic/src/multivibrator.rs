//! Multivibrator: the clock of a blinking lamp (alarm unit, chapter 3).
//!
//! The paper's `TimeLow` is how long the output is *high*; here it is `on_time`. Phases follow each other without gap or
//! drift: what an execution came late for is taken off the next phase.

use crate::{Refusal, refusal};

/// Settings of the multivibrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MultivibratorSettings {
    /// How long the output is on in each period, ns; above 0.
    pub on_time: u64,
    /// How long the output is off in each period, ns; above 0.
    pub off_time: u64,
}

impl Default for MultivibratorSettings {
    fn default() -> Self {
        Self { on_time: 500_000_000, off_time: 500_000_000 }
    }
}

impl MultivibratorSettings {
    /// Refuses times of 0.
    pub fn check(&self) -> Result<(), Refusal> {
        refusal::some_time("on-time", self.on_time)?;
        refusal::some_time("off-time", self.off_time)
    }
}

/// The multivibrator. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Multivibrator {
    /// Whether it runs.
    pub running: bool,
    /// Whether the output is in its on phase.
    pub on: bool,
    /// Time spent in the present phase, ns.
    pub phase: u64,
}

impl Multivibrator {
    /// One execution, `elapsed` ns after the previous one; returns the output: off while `run` is false, else alternating
    /// and beginning with on.
    pub fn execute(&mut self, settings: &MultivibratorSettings, elapsed: u64, run: bool) -> bool {
        if !(run && self.running) {
            *self = Self { running: run, on: run, phase: 0 };
        } else {
            self.advance(settings, elapsed);
        }
        self.on
    }

    /// Goes at most once round: whole periods are taken off first.
    fn advance(&mut self, settings: &MultivibratorSettings, elapsed: u64) {
        let length = |on: bool| if on { settings.on_time } else { settings.off_time }.max(1);
        let rest = length(self.on).saturating_sub(self.phase);
        let Some(mut late) = elapsed.checked_sub(rest) else {
            self.phase = self.phase.saturating_add(elapsed);
            return;
        };
        self.on = !self.on;
        if let Some(period) = length(true).checked_add(length(false)) {
            late = late.checked_rem(period).unwrap_or(0);
        }
        if let Some(later) = late.checked_sub(length(self.on)) {
            (self.on, late) = (!self.on, later);
        }
        self.phase = late;
    }
}
