//! Changes of a block's alarms become records.

use super::Lane;
use latchwork_record::{Datum, Entry, Kind};

/// Priority of an alarm that no rule gives one.
const PRIORITY: u8 = 128;

impl Lane {
    /// One record per alarm that was raised or has returned to normal.
    #[cold]
    pub(super) fn alarms_changed(&mut self, index: usize, now: u64) {
        let block = &mut self.parts.blocks[index];
        let Some((cell, previous)) = &mut block.alarms else { return };
        let current = self.parts.cells[*cell as usize];
        let mut changed = current ^ *previous;
        while changed != 0 {
            let bit = changed.trailing_zeros();
            changed &= changed - 1;
            let Some(source) = block.rest.alarm_sources.get(bit as usize) else {
                *previous ^= 1 << bit;
                continue;
            };
            let raised = current >> bit & 1 == 1;
            let entry = Entry::new(now, Kind::Alarm, *source, if raised { "raised" } else { "returned" })
                .priority(PRIORITY)
                .change(Datum::Boolean(!raised), Datum::Boolean(raised));
            // Without room it is told after the next execution: no condition is ever lost.
            if !self.parts.recorder.offer(entry) {
                return;
            }
            *previous ^= 1 << bit;
        }
    }
}
