//! What is counted over all sequences.

use hdrhistogram::Histogram;

/// The longest execution of a sequence.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Longest {
    pub(super) ns: u64,
    pub(super) step: usize,
    pub(super) execution: u32,
}

/// Sums over all sequences.
#[derive(Debug)]
pub(super) struct Sums {
    pub(super) executions: u64,
    /// How long executions took, ns. Their mean would be that of the machine's other work.
    pub(super) times: Histogram<u32>,
    pub(super) restarts: u64,
    pub(super) taken: u64,
    pub(super) refused: u64,
    pub(super) memory: u64,
    /// By output cell: NaN came out; NaN came out of finite inputs and settings.
    pub(super) nan: Vec<(bool, bool)>,
}
