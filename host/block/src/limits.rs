//! What an instance may use.

/// Limits of one instance. The depth of recursion is the same for all: 512 KiB of stack.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most linear memory, bytes, summed over its memories. Default 4 MiB.
    pub memory: u64,
    /// Longest call, in ticks of the engine's epoch; 0 counts as 1. A call that begins right before a tick has up to one
    /// tick less. Default 10.
    pub budget_ticks: u64,
    /// Longest instantiation, in ticks; it has at least ten times a call's. Default 0.
    pub start_ticks: u64,
    /// Most elements of its tables together. Default 10 000.
    pub table_elements: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { memory: 4 << 20, budget_ticks: 10, start_ticks: 0, table_elements: 10_000 }
    }
}

impl Limits {
    /// Ticks of one call. The bound keeps the epoch's sum far from overflow.
    pub(crate) fn call_ticks(&self) -> u64 {
        self.budget_ticks.clamp(1, u64::MAX / 32)
    }

    /// Ticks of an instantiation.
    pub(crate) fn instantiation_ticks(&self) -> u64 {
        (self.call_ticks() * 10).max(self.start_ticks.min(u64::MAX / 32))
    }
}
