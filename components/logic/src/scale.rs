//! Linear scaling of a raw word to an engineering value (alarm unit, figure 14, blocks 1 and 2).

use crate::{Quality, Refusal, Signal, refusal};

/// A straight line through two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Raw word that stands for `low`.
    pub raw_low: u16,
    /// Raw word that stands for `high`; above `raw_low`.
    pub raw_high: u16,
    /// Value at `raw_low`; finite.
    pub low: f64,
    /// Value at `raw_high`; finite, may be below `low`.
    pub high: f64,
}

impl Default for Scale {
    /// The 15-bit word of an analogue input to 0 to 60.
    fn default() -> Self {
        Self { raw_low: 0, raw_high: 32_767, low: 0.0, high: 60.0 }
    }
}

impl Scale {
    /// Refuses raw words the wrong way round and values that are no numbers.
    pub fn check(&self) -> Result<(), Refusal> {
        refusal::above("raw-high", self.raw_high.into(), "raw-low", self.raw_low.into())?;
        refusal::finite("low", self.low)?;
        refusal::finite("high", self.high)
    }

    /// The value of a word, and whether the word is out of range; then the value is extrapolated and bad. With settings
    /// that `check` accepts the value is always finite.
    #[must_use]
    pub fn execute(&self, raw: u16) -> (Signal, bool) {
        let out_of_range = raw < self.raw_low || raw > self.raw_high;
        let quality = if out_of_range { Quality::Bad } else { Quality::Good };
        (Signal::new(self.value(raw), quality), out_of_range)
    }

    fn value(&self, raw: u16) -> f64 {
        let word = f64::from;
        if raw == self.raw_high {
            return self.high;
        }
        let part = (word(raw) - word(self.raw_low)) / (word(self.raw_high) - word(self.raw_low));
        let span = self.high - self.low;
        // Ends further apart than the largest f64 have opposite signs: there the weighted sum cannot overflow in range.
        let value = if span.is_finite() { self.low + span * part } else { self.low * (1.0 - part) + self.high * part };
        value.clamp(f64::MIN, f64::MAX)
    }
}
