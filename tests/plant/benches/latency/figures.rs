//! Percentiles.

/// What became of many samples, ns.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Figures {
    /// Samples.
    pub(crate) count: usize,
    /// Median.
    pub(crate) p50: u64,
    /// 99 of 100 are not longer.
    pub(crate) p99: u64,
    /// 999 of 1000 are not longer.
    pub(crate) p999: u64,
    /// Longest.
    pub(crate) max: u64,
}

impl Figures {
    pub(crate) fn new(mut samples: Vec<u64>) -> Self {
        samples.sort_unstable();
        let at = |part: f64| {
            let index = (samples.len() as f64 * part).ceil() as usize;
            samples.get(index.clamp(1, samples.len().max(1)) - 1).copied().unwrap_or(0)
        };
        Self { count: samples.len(), p50: at(0.5), p99: at(0.99), p999: at(0.999), max: at(1.0) }
    }

    /// `| 12.3 | … |`, µs.
    pub(crate) fn row(&self) -> String {
        [self.p50, self.p99, self.p999, self.max].map(|ns| format!("{:.1}", ns as f64 / 1000.0)).join(" | ")
    }
}
