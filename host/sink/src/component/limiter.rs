//! Memory of a logger, counted over all its memories and tables.

use wasmtime::{ResourceLimiter, Result};

/// Most elements of all tables together: functions of a language's runtime.
const TABLE_ELEMENTS: usize = 1_000_000;

/// Counts and refuses.
pub(super) struct Limiter {
    memory: usize,
    memory_left: usize,
    elements_left: usize,
    refused: bool,
}

impl Limiter {
    /// With a limit in bytes.
    pub(super) fn new(memory: u64) -> Self {
        let memory = usize::try_from(memory).unwrap_or(usize::MAX);
        Self { memory, memory_left: memory, elements_left: TABLE_ELEMENTS, refused: false }
    }

    /// The limit, if the logger wanted more than that.
    pub(super) fn exceeded(&self) -> Option<u64> {
        self.refused.then_some(self.memory as u64)
    }

    fn take(left: &mut usize, current: usize, desired: usize) -> bool {
        let enough = desired.saturating_sub(current) <= *left;
        if enough {
            *left -= desired.saturating_sub(current);
        }
        enough
    }
}

impl ResourceLimiter for Limiter {
    fn memory_growing(&mut self, current: usize, desired: usize, _: Option<usize>) -> Result<bool> {
        let granted = Self::take(&mut self.memory_left, current, desired);
        self.refused |= !granted;
        Ok(granted)
    }

    fn table_growing(&mut self, current: usize, desired: usize, _: Option<usize>) -> Result<bool> {
        Ok(Self::take(&mut self.elements_left, current, desired))
    }
}
