//! Bool tags that alarms hang on: a change becomes an entry at the end of a scan.

use super::LaneParts;
use crate::alarms::{CONDITION, SUPPRESSING};
use crate::layout::Probe;
use latchwork_record::{Datum, Entry, Kind, SourceId};

/// A bool tag that this lane watches.
pub struct Condition {
    /// Where the lane sees it.
    pub probe: Probe,
    /// What was told last; `None`: it must be told in any case.
    pub previous: Option<bool>,
    /// The tag as a source.
    pub source: SourceId,
    /// It suppresses alarms; otherwise it is the condition of one.
    pub suppresses: bool,
}

impl LaneParts {
    /// One entry for each watched tag that has changed.
    #[inline]
    pub(super) fn watch_conditions(&mut self, now: u64) {
        for condition in &mut self.conditions {
            let on = condition.probe.read(&self.cells) & 1 == 1;
            if condition.previous != Some(on) {
                let transition = if condition.suppresses { SUPPRESSING } else { CONDITION };
                let entry = Entry::new(now, Kind::Alarm, condition.source, transition);
                // Without room it is told after the next scan: no condition is ever lost.
                if self.recorder.offer(entry.change(Datum::Boolean(!on), Datum::Boolean(on))) {
                    condition.previous = Some(on);
                }
            }
        }
    }
}
