//! Hot swap: another version of a block under a running plant.
//!
//! ```text
//! order ─► prepare (own thread: load, check, compile, instantiate, configure) ─► plan
//!       ─► shadow (candidate fed by a tap of the lane, off it) ─► exchange (in the lane, between two scans)
//!       ─► probation (the old instance waits) ─► done, or rolled back
//! ```

mod order;
pub mod save;
mod status;

pub use order::{Part, SwapOrder, Tolerance};
pub use status::{BlockPlan, Deviation, FailedRun, ShadowReport, Stage, SwapStatus, Version};

use crate::assemble::Plant;

/// All swaps of a plant: what is under way, and the versions of each block.
#[derive(Default)]
pub struct Swaps {}

impl Plant {
    /// What is under way goes on, at plant time `now`, ns.
    pub(crate) fn swap_turn(&mut self, now: u64) {
        let _ = now;
    }
}
