//! The flight recorder: what chosen blocks got and gave, in a bounded ring.

use crate::assemble::Plant;

/// What is recorded.
#[derive(Default)]
pub struct Recorder {}

impl Plant {
    /// Takes what the lanes have recorded.
    pub(crate) fn recorder_turn(&mut self, now: u64) {
        let _ = now;
    }
}
