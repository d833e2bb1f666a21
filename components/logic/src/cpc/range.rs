//! The straight line between a raw range and a range in engineering units, both ways.

use crate::{Refusal, refusal};

/// Two ranges whose ends stand for each other.
#[derive(Clone, Copy)]
pub(super) struct Range {
    pub(super) raw_low: f64,
    pub(super) raw_high: f64,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Range {
    /// Refuses ends that are no numbers, raw ends the wrong way round, and a range without extent.
    pub(super) fn check(&self) -> Result<(), Refusal> {
        refusal::finite("raw-low", self.raw_low)?;
        refusal::finite("raw-high", self.raw_high)?;
        refusal::finite("low", self.low)?;
        refusal::finite("high", self.high)?;
        if self.raw_low >= self.raw_high {
            return Err(Refusal::related(("raw-high", self.raw_high), "above", ("raw-low", self.raw_low)));
        }
        if self.low == self.high {
            return Err(Refusal::related(("high", self.high), "different from", ("low", self.low)));
        }
        Ok(())
    }

    pub(super) fn to_value(self, raw: f64) -> f64 {
        map(raw, (self.raw_low, self.raw_high), (self.low, self.high))
    }

    pub(super) fn to_raw(self, value: f64) -> f64 {
        map(value, (self.low, self.high), (self.raw_low, self.raw_high))
    }

    /// The nearest value within `low` to `high`, whichever of them is the smaller; `low` for NaN.
    pub(super) fn clamp(&self, value: f64) -> f64 {
        let (least, most) = (self.low.min(self.high), self.low.max(self.high));
        if value.is_nan() { self.low } else { value.max(least).min(most) }
    }
}

/// The ends are met exactly, and the sum is weighted so that finite ranges however wide overflow nowhere between them.
fn map(x: f64, (x0, x1): (f64, f64), (y0, y1): (f64, f64)) -> f64 {
    if x == x1 {
        return y1;
    }
    // Halves, because the distance of two finite numbers may be infinite.
    let part = (x * 0.5 - x0 * 0.5) / (x1 * 0.5 - x0 * 0.5);
    let y = y0 * (1.0 - part) + y1 * part;
    if y.is_nan() { y0 } else { y.clamp(f64::MIN, f64::MAX) }
}
