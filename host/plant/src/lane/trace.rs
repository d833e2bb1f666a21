//! The trace: a row whenever a traced tag has changed at the end of a scan.

use crate::layout::Probe;
use latchwork_image::TagId;

/// A change of a traced tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// Plant time of the scan, ns.
    pub time: u64,
    /// Lane.
    pub lane: u32,
    /// Tag.
    pub tag: TagId,
    /// New value.
    pub cell: u64,
}

/// One traced tag.
pub struct Watch {
    tag: TagId,
    probe: Probe,
    last: Option<u64>,
}

impl Watch {
    /// Watches a tag; its first value counts as a change.
    pub fn new(tag: TagId, probe: Probe) -> Self {
        Self { tag, probe, last: None }
    }
}

/// The traced tags of one lane and the queue their changes go to.
pub struct Tracer {
    lane: u32,
    watches: Vec<Watch>,
    changes: Option<rtrb::Producer<Change>>,
    lost: u64,
}

impl Tracer {
    /// A tracer; `None` traces nothing.
    pub fn new(lane: u32, watches: Vec<Watch>, changes: Option<rtrb::Producer<Change>>) -> Self {
        Self { lane, watches, changes, lost: 0 }
    }

    /// Changes that found the queue full.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    #[inline]
    pub(super) fn scan(&mut self, time: u64, cells: &[u64]) {
        let Some(changes) = &mut self.changes else { return };
        for watch in &mut self.watches {
            let cell = watch.probe.read(cells);
            if watch.last != Some(cell) {
                watch.last = Some(cell);
                let change = Change { time, lane: self.lane, tag: watch.tag, cell };
                if changes.push(change).is_err() {
                    self.lost += 1;
                }
            }
        }
    }
}
