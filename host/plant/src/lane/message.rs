//! Messages of blocks: passed on as records, a flood of them only counted.

use super::Lane;
use latchwork_record::{Datum, Entry, Kind};

/// Messages of one block that may come at once.
const BURST: u32 = 20;
/// Plant time after which one more message may come, ns: ten a second.
const INTERVAL: u64 = 100_000_000;

/// How many messages a block may still send, and what it lost.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    left: u32,
    since: u64,
    suppressed: u64,
    last_suppressed: u64,
}

impl Default for Budget {
    fn default() -> Self {
        Self { left: BURST, since: 0, suppressed: 0, last_suppressed: 0 }
    }
}

impl Budget {
    fn take(&mut self, now: u64) -> bool {
        let earned = now.saturating_sub(self.since) / INTERVAL;
        if earned > 0 {
            self.left = u32::try_from(earned).unwrap_or(BURST).saturating_add(self.left).min(BURST);
            self.since += earned * INTERVAL;
        }
        if self.left == 0 {
            return false;
        }
        self.left -= 1;
        true
    }
}

impl Lane {
    /// Takes what the block logged in this execution.
    #[cold]
    pub(super) fn take_messages(&mut self, index: usize, now: u64) {
        let block = &mut self.parts.blocks[index];
        let Some(instance) = &mut block.instance else { return };
        let (recorder, rest) = (&mut self.parts.recorder, &mut *block.rest);
        let (source, budget) = (rest.source, &mut rest.messages);
        let flooding = budget.suppressed > 0;
        // A second without loss ends the flood.
        if flooding && now.saturating_sub(budget.last_suppressed) >= 10 * INTERVAL {
            let count = std::mem::take(&mut budget.suppressed);
            recorder.push(
                Entry::new(now, Kind::Message, source, "flood-end")
                    .change(Datum::None, Datum::Integer(i64::try_from(count).unwrap_or(i64::MAX)))
                    .text(format_args!("{count} messages were not passed on")),
            );
        }
        let mut lost = 0;
        let dropped = instance.drain_log(|level, text| {
            if budget.take(now) {
                let entry = Entry::new(now, Kind::Message, source, level.name()).priority(level.priority());
                recorder.push(entry.text(format_args!("{text}")));
            } else {
                lost += 1;
            }
        });
        lost += dropped;
        if lost > 0 {
            if budget.suppressed == 0 {
                recorder.push(Entry::new(now, Kind::Message, source, "flood").priority(50).text(format_args!(
                    "the block logs more than {BURST} messages at once or ten a second; the rest is counted only"
                )));
            }
            budget.suppressed += lost;
            budget.last_suppressed = now;
        }
    }

    /// Tells what floods swallowed, at the end of a run.
    pub(super) fn settle_messages(&mut self, now: u64) {
        for block in &mut self.parts.blocks {
            let count = std::mem::take(&mut block.rest.messages.suppressed);
            if count > 0 {
                self.parts.recorder.push(
                    Entry::new(now, Kind::Message, block.rest.source, "flood-end")
                        .change(Datum::None, Datum::Integer(i64::try_from(count).unwrap_or(i64::MAX)))
                        .text(format_args!("{count} messages were not passed on")),
                );
            }
        }
    }
}
