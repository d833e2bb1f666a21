//! A real value with its quality, as `latchwork:block/types` has it, for logic that must judge both.

/// How far a value can be trusted; from best to worst.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quality {
    /// Fresh and believed.
    #[default]
    Good,
    /// Held, stale or estimated: usable with care.
    Uncertain,
    /// Not to be used.
    Bad,
}

/// A real value and its quality.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Signal {
    /// The value, any unit; may be NaN or infinite.
    pub value: f64,
    /// How far the value can be trusted.
    pub quality: Quality,
}

impl Signal {
    /// A value with its quality.
    #[must_use]
    pub const fn new(value: f64, quality: Quality) -> Self {
        Self { value, quality }
    }

    /// Whether the value can be calculated with: finite, and its quality not bad.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.value.is_finite() && self.quality != Quality::Bad
    }
}
