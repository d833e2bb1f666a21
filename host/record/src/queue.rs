//! The bounded queue between a lane and the router.

use crate::{Entry, Incoming, Kind, SourceId};

/// The sending end, owned by one lane, driver or operator interface.
pub struct Recorder {
    producer: rtrb::Producer<Entry>,
    source: SourceId,
    lost: u64,
}

/// A queue of `capacity` entries; `source` is named when entries are lost.
pub fn queue(capacity: usize, source: SourceId) -> (Recorder, Incoming) {
    let (producer, consumer) = rtrb::RingBuffer::new(capacity.max(2));
    (Recorder { producer, source, lost: 0 }, Incoming::new(consumer))
}

impl Recorder {
    /// Pushes an entry; never waits, never allocates. What finds no room is counted, and the count becomes one `lost`
    /// record as soon as there is room again.
    #[inline]
    pub fn push(&mut self, entry: Entry) {
        if self.lost > 0 && !self.tell_lost(entry.time) {
            self.lost += 1;
            return;
        }
        if self.producer.push(entry).is_err() {
            self.lost += 1;
        }
    }

    /// Pushes an entry if there is room for it; it is not lost otherwise, because whoever offers it does so again.
    #[inline]
    #[must_use]
    pub fn offer(&mut self, entry: Entry) -> bool {
        if self.lost > 0 && !self.tell_lost(entry.time) {
            return false;
        }
        self.producer.push(entry).is_ok()
    }

    /// Sends the `lost` record if one is due and there is room for it; call it once per scan.
    #[inline]
    pub fn settle(&mut self, now: u64) {
        if self.lost > 0 {
            self.tell_lost(now);
        }
    }

    fn tell_lost(&mut self, now: u64) -> bool {
        let lost = self.lost;
        let entry = Entry::new(now, Kind::Lost, self.source, "overflow")
            .priority(200)
            .change(crate::Datum::None, crate::Datum::Integer(i64::try_from(lost).unwrap_or(i64::MAX)))
            .text(format_args!("{lost} records found the queue full and are gone"));
        // Room for the entry that follows, too: otherwise a full queue would hold nothing but `lost`.
        if self.producer.slots() < 2 || self.producer.push(entry).is_err() {
            return false;
        }
        self.lost = 0;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Datum, Router};

    #[test]
    fn an_overflow_is_counted_and_told_once() {
        let mut router = Router::new(vec!["lane.main".into()]);
        let (mut recorder, incoming) = queue(4, SourceId(0));
        router.add(incoming);
        for n in 0..10 {
            recorder.push(Entry::new(n, Kind::Event, SourceId(0), "x"));
        }
        let mut seen = Vec::new();
        router.release(u64::MAX, |r| seen.push((r.kind, r.current.clone())));
        assert_eq!(seen.len(), 4);
        recorder.push(Entry::new(10, Kind::Event, SourceId(0), "x"));
        seen.clear();
        router.release(u64::MAX, |r| seen.push((r.kind, r.current.clone())));
        assert_eq!(seen, [(Kind::Lost, Datum::Integer(6).into()), (Kind::Event, Datum::None.into())]);
    }
}
