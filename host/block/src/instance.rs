//! A block's instance: one store, one class, one call path.

use crate::{Class, Fault, Level};

/// One pass of a lane as a block sees it, `latchwork:block/types.scan`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scan {
    /// Plant time, ns.
    pub now: u64,
    /// Since this block's previous execution, ns.
    pub elapsed: u64,
    /// First execution after a cold start.
    pub first: bool,
}

/// An instance in a store of its own. After a fault every further call is a fault, too.
pub struct Instance {}

impl Instance {
    /// The class it is used as.
    pub fn class(&self) -> &Class {
        todo!()
    }

    /// Executes the block once. `ins` holds the indices of the argument cells: inputs in the order of the class, each
    /// signal's quality behind its value, then the commands word. The outputs, each signal's quality behind its value,
    /// then the alarms word are written from cell `out` on. After an error no cell has changed.
    ///
    /// # Panics
    /// When `ins` does not have [`Class::argument_cells`] entries, or an index is outside `cells`.
    pub fn execute(&mut self, _scan: Scan, _ins: &[u32], _out: u32, _cells: &mut [u64]) -> Result<(), Fault> {
        todo!()
    }

    /// Gives the block its settings, one cell per port; the inner error is the block's own sentence why it refuses them.
    /// A class without settings accepts nothing but an empty slice.
    pub fn configure(&mut self, _settings: &[u64]) -> Result<Result<(), String>, Fault> {
        todo!()
    }

    /// The settings the block proposes itself, one cell per port; `None` when it has no function `defaults`.
    pub fn defaults(&mut self) -> Result<Option<Vec<u64>>, Fault> {
        todo!()
    }

    /// The state to carry over, one cell per port of `retained`; `None` when the class retains nothing.
    pub fn save(&mut self) -> Result<Option<Vec<u64>>, Fault> {
        todo!()
    }

    /// Hands back a state that `save` gave; does nothing when the class retains nothing.
    pub fn restore(&mut self, _state: &[u64]) -> Result<(), Fault> {
        todo!()
    }

    /// Messages wait.
    pub fn has_log(&self) -> bool {
        todo!()
    }

    /// Takes the waiting messages and returns the number of those that were dropped.
    pub fn drain_log(&mut self, _take: impl FnMut(Level, &str)) -> u64 {
        todo!()
    }
}
