//! What an instance may use.

/// Limits of one instance.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most linear memory, bytes, summed over its memories. Default 4 MiB.
    pub memory: u64,
    /// Longest call, in ticks of the engine's epoch, at least 1; instantiation has ten times as much. Default 10.
    pub budget_ticks: u64,
    /// Most elements of its tables together. Default 10 000.
    pub table_elements: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { memory: 4 << 20, budget_ticks: 10, table_elements: 10_000 }
    }
}
