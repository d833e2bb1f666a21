//! Whether the field follows an order within its time.

/// Time since the field differs from the order. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Supervision {
    /// The order of the last execution.
    pub order: bool,
    /// The field differed from it.
    pub differs: bool,
    /// How long it has differed, ns; no more than the time it may.
    pub elapsed: u64,
}

impl Supervision {
    /// One execution, `elapsed` ns after the previous one; returns whether the field has differed for `time`. Each new
    /// order has the whole time.
    pub(crate) fn execute(&mut self, elapsed: u64, order: bool, differs: bool, time: u64) -> bool {
        let goes_on = differs && self.differs && order == self.order;
        let elapsed = if goes_on { self.elapsed.saturating_add(elapsed) } else { 0 };
        *self = Self { order, differs, elapsed: elapsed.min(time) };
        differs && self.elapsed >= time
    }
}
