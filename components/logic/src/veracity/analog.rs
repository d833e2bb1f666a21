//! Veracity check of an analogue signal: spikes, dips and line breaks are held off (alarm unit, figure 7).
//!
//! Added to the paper's listing: the first usable sample seeds the stored value (the listing leaves it at 0, so a healthy
//! signal would be an error from the start), NaN and infinities are never stored, a check period independent of the scan,
//! and a moving average, both of which the paper names.

use crate::{Quality, Refusal, Signal, refusal};

/// Largest number of samples of the moving average.
const AVERAGE_MAX: u8 = 16;

/// Settings of the check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalogSettings {
    /// Largest allowed movement per check, exclusive (MSpeed); finite, above 0.
    pub max_step: f64,
    /// Time between two checks, ns; 0 checks in every execution.
    pub period: u64,
    /// Moving average over this many accepted samples, 1 to 16.
    pub average: u8,
}

impl Default for AnalogSettings {
    fn default() -> Self {
        Self { max_step: 5.0, period: 0, average: 1 }
    }
}

impl AnalogSettings {
    /// Refuses settings outside their ranges.
    pub fn check(&self) -> Result<(), Refusal> {
        refusal::above_zero("max-step", self.max_step)?;
        let fits = (1..=AVERAGE_MAX).contains(&self.average);
        refusal::whole(fits, "average", self.average.into(), "1 to 16 samples")
    }
}

/// The check.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnalogVeracity {
    /// Accepted samples, newest first, of which `count` are valid.
    samples: [f64; AVERAGE_MAX as usize],
    count: u8,
    /// Outputs of the last check, which stand until the next.
    out: Signal,
    error: bool,
    /// Whether the running period began with a check; if not, the next execution checks.
    running: bool,
    /// Time since the period began, ns.
    since: u64,
}

/// What survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnalogState {
    /// The last accepted sample, if any.
    pub accepted: Option<f64>,
    /// Whether the last check failed.
    pub error: bool,
}

impl AnalogVeracity {
    /// One execution, `elapsed` ns after the previous one; returns the signal and whether the input is not believed.
    ///
    /// `on` false is the repeater: the output is the input, whatever it is, and the stored value follows it where it is
    /// usable. There, too, an unusable input is an error, and its quality is bad.
    pub fn execute(&mut self, settings: &AnalogSettings, elapsed: u64, on: bool, signal: Signal) -> (Signal, bool) {
        let usable = signal.is_usable();
        if !on {
            if usable {
                self.reset();
                self.accept(signal.value);
            }
            self.running = false;
            self.error = !usable;
            self.out = Signal { quality: if usable { signal.quality } else { Quality::Bad }, ..signal };
        } else if self.is_due(settings.period, elapsed) {
            let near = self.accepted().is_none_or(|a| (signal.value - a).abs() < settings.max_step);
            self.error = !(usable && near);
            if !self.error {
                self.accept(signal.value);
            }
            self.out = match self.held(settings) {
                Some(value) if self.error => Signal::new(value, Quality::Uncertain),
                Some(value) => Signal::new(value, signal.quality),
                None => Signal::new(0.0, Quality::Bad),
            };
        }
        (self.out, self.error)
    }

    /// Forgets the stored value: the next execution checks, and accepts a usable sample as it is.
    pub fn reset(&mut self) {
        (self.count, self.running) = (0, false);
    }

    /// The average of the accepted samples, which is what is held during an error; none before one was accepted.
    #[must_use]
    pub fn held(&self, settings: &AnalogSettings) -> Option<f64> {
        let count = self.count.min(settings.average.max(1));
        let samples = || self.samples.iter().copied().take(count.into());
        let n = f64::from(count);
        let (low, high) = (samples().reduce(f64::min)?, samples().reduce(f64::max)?);
        let sum: f64 = samples().sum();
        let mean = if sum.is_finite() { sum / n } else { samples().map(|s| s / n).sum() };
        // Rounding must not carry the mean out of what was accepted.
        Some(mean.max(low).min(high))
    }

    /// The state to carry over. The average starts anew from it, and the first execution checks.
    #[must_use]
    pub fn save(&self) -> AnalogState {
        AnalogState { accepted: self.accepted(), error: self.error }
    }

    /// Goes on from a saved state; an accepted value that is not finite counts as none.
    pub fn restore(&mut self, state: AnalogState) {
        *self = Self { error: state.error, ..Self::default() };
        if let Some(value) = state.accepted.filter(|v| v.is_finite()) {
            self.accept(value);
        }
    }

    fn accepted(&self) -> Option<f64> {
        self.samples.first().copied().filter(|_| self.count > 0)
    }

    fn accept(&mut self, value: f64) {
        self.samples.rotate_right(1);
        self.samples[0] = value;
        self.count = self.count.saturating_add(1).min(AVERAGE_MAX);
    }

    /// Counts the period. What an execution came too late for is not caught up on, but the rhythm stays.
    fn is_due(&mut self, period: u64, elapsed: u64) -> bool {
        self.since = if self.running { self.since.saturating_add(elapsed) } else { period };
        let due = self.since >= period;
        if due {
            (self.running, self.since) = (true, self.since.checked_rem(period).unwrap_or(0));
        }
        due
    }
}
