//! State that outlives a restart: `retain = true`.

use crate::assemble::Plant;

/// What was saved, and when it is saved next.
#[derive(Default)]
pub struct Keeper {}

impl Plant {
    /// Saves what is due and stores what was saved, at plant time `now`, ns.
    pub(crate) fn retain_turn(&mut self, now: u64) {
        let _ = now;
    }

    /// A state of a block that somebody else has saved: before a swap.
    pub(crate) fn retain_saved(&mut self, block: usize, cells: &[u64], now: u64) {
        let _ = (block, cells, now);
    }
}
