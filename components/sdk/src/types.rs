//! The types every device class shares (`latchwork:block/types`), with what makes them handy in Rust.

pub use crate::bindings::latchwork::block::types::{BoolSignal, Duration, Quality, RealSignal, Scan};

impl Duration {
    /// No time at all.
    pub const ZERO: Self = Self { ns: 0 };

    /// A span of nanoseconds.
    #[must_use]
    pub const fn from_nanos(ns: u64) -> Self {
        Self { ns }
    }

    /// A span of milliseconds; the longest possible one where it does not fit (above 584 years).
    #[must_use]
    pub const fn from_millis(ms: u64) -> Self {
        Self { ns: ms.saturating_mul(1_000_000) }
    }

    /// A span of seconds; the longest possible one where it does not fit (above 584 years).
    #[must_use]
    pub const fn from_secs(s: u64) -> Self {
        Self { ns: s.saturating_mul(1_000_000_000) }
    }
}

impl Default for Duration {
    fn default() -> Self {
        Self::ZERO
    }
}

impl Eq for Duration {}

impl PartialOrd for Duration {
    fn partial_cmp(&self, other: &Self) -> Option<core::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Duration {
    fn cmp(&self, other: &Self) -> core::cmp::Ordering {
        self.ns.cmp(&other.ns)
    }
}

impl Default for Scan {
    /// Time 0, not the first execution.
    fn default() -> Self {
        Self { now: 0, elapsed: 0, first: false }
    }
}

impl Default for Quality {
    fn default() -> Self {
        Self::Good
    }
}

impl Default for RealSignal {
    fn default() -> Self {
        Self::good(0.0)
    }
}

impl Default for BoolSignal {
    fn default() -> Self {
        Self::good(false)
    }
}

impl RealSignal {
    /// A value to be trusted.
    #[must_use]
    pub const fn good(value: f64) -> Self {
        Self { value, quality: Quality::Good }
    }

    /// A value with its quality.
    #[must_use]
    pub const fn new(value: f64, quality: Quality) -> Self {
        Self { value, quality }
    }
}

impl BoolSignal {
    /// A value to be trusted.
    #[must_use]
    pub const fn good(value: bool) -> Self {
        Self { value, quality: Quality::Good }
    }

    /// A value with its quality.
    #[must_use]
    pub const fn new(value: bool, quality: Quality) -> Self {
        Self { value, quality }
    }
}
