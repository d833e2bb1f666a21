//! The router: one ordered, numbered stream out of all queues.

use crate::{Entry, Kind, Record, SourceId};
use latchwork_image::Value;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The receiving end of a queue.
pub struct Incoming {
    consumer: rtrb::Consumer<Entry>,
}

impl Incoming {
    pub(crate) fn new(consumer: rtrb::Consumer<Entry>) -> Self {
        Self { consumer }
    }
}

/// An entry that waits for its turn; ordered by time, then by arrival.
struct Waiting {
    order: (u64, u64),
    entry: Entry,
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.order == other.order
    }
}
impl Eq for Waiting {}
impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.order.cmp(&other.order)
    }
}

/// Orders the entries of all queues by time and numbers them.
pub struct Router {
    sources: Vec<String>,
    incoming: Vec<Incoming>,
    waiting: BinaryHeap<Reverse<Waiting>>,
    arrivals: u64,
    seq: u64,
    epoch: u64,
}

impl Router {
    /// A router for sources of these names, numbered from 0.
    pub fn new(sources: Vec<String>) -> Self {
        Self { sources, incoming: Vec::new(), waiting: BinaryHeap::new(), arrivals: 0, seq: 0, epoch: 0 }
    }

    /// Sets when plant time 0 was, ns since 1970. Virtual time leaves it at 0, so that two runs are equal.
    pub fn set_epoch(&mut self, epoch: u64) {
        self.epoch = epoch;
    }

    /// Goes on after a number: that of the last record there may be.
    pub fn continue_after(&mut self, seq: u64) {
        self.seq = seq;
    }

    /// Adds a queue. Entries of equal time leave in the order of the queues.
    pub fn add(&mut self, incoming: Incoming) {
        self.incoming.push(incoming);
    }

    /// Name of a source.
    pub fn source(&self, id: SourceId) -> &str {
        self.sources.get(id.0 as usize).map_or("?", String::as_str)
    }

    /// Number of the last record.
    pub fn last_seq(&self) -> u64 {
        self.seq
    }

    /// Takes what the queues hold and releases, in order of time, every entry older than `before` (plant time, ns).
    /// An entry that comes later than younger ones keeps its own time and follows them.
    pub fn release(&mut self, before: u64, mut to: impl FnMut(&Record)) {
        for incoming in &mut self.incoming {
            while let Ok(entry) = incoming.consumer.pop() {
                self.arrivals += 1;
                self.waiting.push(Reverse(Waiting { order: (entry.time, self.arrivals), entry }));
            }
        }
        while self.waiting.peek().is_some_and(|w| w.0.entry.time < before) {
            if let Some(Reverse(Waiting { entry, .. })) = self.waiting.pop() {
                self.seq += 1;
                to(&self.record(&entry));
            }
        }
    }

    /// A record of who has no queue of its own, at plant time `time`; it leaves at once.
    pub fn note(
        &mut self,
        time: u64,
        kind: Kind,
        source: &str,
        transition: &'static str,
        text: String,
        mut to: impl FnMut(&Record),
    ) {
        self.seq += 1;
        to(&Record {
            seq: self.seq,
            time: self.epoch.saturating_add(time),
            kind,
            source: source.to_owned(),
            transition: transition.into(),
            previous: Value::None,
            current: Value::None,
            priority: 255,
            user: String::new(),
            text,
        });
    }

    fn record(&self, entry: &Entry) -> Record {
        Record {
            seq: self.seq,
            time: self.epoch.saturating_add(entry.time),
            kind: entry.kind,
            source: self.source(entry.source).to_owned(),
            transition: entry.transition.into(),
            previous: entry.previous.into(),
            current: entry.current.into(),
            priority: entry.priority,
            user: String::new(),
            text: entry.text.as_str().to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::queue;

    #[test]
    fn entries_leave_by_time_across_queues() {
        let mut router = Router::new(vec!["a".into(), "b".into()]);
        let (mut a, ia) = queue(8, SourceId(0));
        let (mut b, ib) = queue(8, SourceId(1));
        router.add(ia);
        router.add(ib);
        for t in [1, 4, 6] {
            a.push(Entry::new(t, Kind::Event, SourceId(0), "x"));
        }
        for t in [2, 4, 5] {
            b.push(Entry::new(t, Kind::Event, SourceId(1), "x"));
        }
        let mut seen = Vec::new();
        router.release(5, |r| seen.push((r.seq, r.time, r.source.clone())));
        router.release(u64::MAX, |r| seen.push((r.seq, r.time, r.source.clone())));
        let expected: Vec<_> = [(1, "a"), (2, "b"), (4, "a"), (4, "b"), (5, "b"), (6, "a")]
            .into_iter()
            .enumerate()
            .map(|(i, (t, s))| (i as u64 + 1, t, s.to_string()))
            .collect();
        assert_eq!(seen, expected);
    }
}
