//! From what the queues hold to numbered records, in the order of time, with the life of the alarms between.

use super::Observer;
use crate::alarms::{AlarmWish, Told};
use crate::assemble::Plant;
use crate::operate::{Answer, Pending, Wish};
use latchwork_record::{Draft, Kept, Turn};

/// After so many records the lanes' queues are emptied again.
const COLLECT: u32 = 64;

impl Plant {
    /// Passes on the trace rows there are and the records older than `before`; it is `now` (plant time, ns).
    pub(super) fn drain(&mut self, before: u64, now: u64, observer: &mut dyn Observer) {
        for changes in &mut self.trace {
            while let Ok(change) = changes.pop() {
                observer.change(&change);
            }
        }
        self.router.collect();
        let mut turns = 0u32;
        while let Some(turn) = self.router.next(before) {
            self.turn(turn, observer);
            // A flood takes its time, and meanwhile the lanes' queues must not fill up.
            turns = turns.wrapping_add(1);
            if turns.is_multiple_of(COLLECT) {
                self.router.collect();
            }
        }
        // Older entries may still come for what is due later.
        if let Some(last) = before.min(now).checked_sub(1) {
            self.due(last, observer);
        }
    }

    fn turn(&mut self, turn: Turn<Wish>, observer: &mut dyn Observer) {
        match turn {
            Turn::Entry(entry) => {
                self.due(entry.time, observer);
                let mut told = Vec::new();
                if self.annunciator.entry(&entry, &mut told) {
                    self.announce(told, observer);
                } else {
                    let draft = self.router.draft(&entry);
                    self.number(draft, &[], observer);
                }
            }
            Turn::Inserted(time, wish) => {
                self.due(time, observer);
                match wish {
                    Wish::Record(draft, kept) => self.number(*draft, &kept, observer),
                    Wish::Alarms(wish) => self.alarm_wish(*wish, time, observer),
                }
            }
        }
    }

    /// Delays and shelves that are over at `time`.
    fn due(&mut self, time: u64, observer: &mut dyn Observer) {
        if self.annunciator.is_due(time) {
            let mut told = Vec::new();
            self.annunciator.tick(time, &mut told);
            self.announce(told, observer);
        }
    }

    fn alarm_wish(&mut self, (pending, wish): (Pending, AlarmWish), time: u64, observer: &mut dyn Observer) {
        if pending.given_up() {
            return;
        }
        let mut told = Vec::new();
        let result = self.annunciator.operate(&wish, &pending.operator, time, &mut told);
        self.announce(told, observer);
        if let Err(refused) = &result {
            let draft = pending.refusal(time, &refused.message);
            self.number(draft, &[], observer);
        }
        pending.answer(result.map(|done| Answer::Done { done }));
    }

    fn announce(&mut self, told: Vec<Told>, observer: &mut dyn Observer) {
        for Told { draft, alarm, after } in told {
            let record = self.router.number(draft);
            let kept = self.annunciator.recorded(alarm, &after, &record);
            observer.record(&record, &[kept]);
        }
    }

    fn number(&mut self, draft: Draft, kept: &[Kept], observer: &mut dyn Observer) {
        let record = self.router.number(draft);
        observer.record(&record, kept);
    }
}
