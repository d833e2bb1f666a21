//! The router: one ordered, numbered stream out of all queues.

use crate::{Draft, Entry, Record, SourceId};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;

/// Rank of an entry that is nothing special.
const ORDINARY: u8 = 1;
/// Rank of what was inserted.
const INSERTED: u8 = 2;

/// The receiving end of a queue.
pub struct Incoming {
    consumer: rtrb::Consumer<Entry>,
}

impl Incoming {
    pub(crate) fn new(consumer: rtrb::Consumer<Entry>) -> Self {
        Self { consumer }
    }
}

/// What waits for its turn; ordered by time, then by rank, then by arrival.
struct Waiting<W> {
    order: (u64, u8, u64),
    turn: Turn<W>,
}

impl<W> PartialEq for Waiting<W> {
    fn eq(&self, other: &Self) -> bool {
        self.order == other.order
    }
}
impl<W> Eq for Waiting<W> {}
impl<W> PartialOrd for Waiting<W> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl<W> Ord for Waiting<W> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.order.cmp(&other.order)
    }
}

/// Whose turn it is.
#[derive(Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "nearly all are entries: a box would be an allocation for each")]
pub enum Turn<W> {
    /// An entry of a queue.
    Entry(Entry),
    /// What was inserted, with its plant time, ns.
    Inserted(u64, W),
}

/// Orders the entries of all queues by time and numbers records. Between entries, in the order of their times, it passes on
/// what was inserted: drafts of whoever has no queue, wishes that must see what came before them.
pub struct Router<W = Draft> {
    sources: Vec<String>,
    incoming: Vec<Incoming>,
    waiting: BinaryHeap<Reverse<Waiting<W>>>,
    arrivals: u64,
    seq: u64,
    epoch: u64,
    rank: fn(&Entry) -> u8,
}

impl<W> Router<W> {
    /// A router for sources of these names, numbered from 0.
    pub fn new(sources: Vec<String>) -> Self {
        Self {
            sources,
            incoming: Vec::new(),
            waiting: BinaryHeap::new(),
            arrivals: 0,
            seq: 0,
            epoch: 0,
            rank: |_| ORDINARY,
        }
    }

    /// Which entries go before others of the same time: those of a smaller rank; ordinary ones have 1, what was inserted
    /// has 2.
    pub fn rank_by(&mut self, rank: fn(&Entry) -> u8) {
        self.rank = rank;
    }

    /// Sets when plant time 0 was, ns since 1970. Virtual time leaves it at 0, so that two runs are equal.
    pub fn set_epoch(&mut self, epoch: u64) {
        self.epoch = epoch;
    }

    /// When plant time 0 was, ns since 1970.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// Goes on after a number: that of the last record there may be.
    pub fn continue_after(&mut self, seq: u64) {
        self.seq = seq;
    }

    /// Adds a queue. Entries of equal time leave in the order of the queues.
    pub fn add(&mut self, incoming: Incoming) {
        self.incoming.push(incoming);
    }

    /// One source more.
    pub fn add_source(&mut self, name: String) -> SourceId {
        self.sources.push(name);
        SourceId((self.sources.len() - 1) as u32)
    }

    /// Name of a source.
    pub fn source(&self, id: SourceId) -> &str {
        self.sources.get(id.0 as usize).map_or("?", String::as_str)
    }

    /// Number of the last record.
    pub fn last_seq(&self) -> u64 {
        self.seq
    }

    /// Inserts something at plant time `time`, ns.
    pub fn insert(&mut self, time: u64, what: W) {
        self.wait(time, INSERTED, Turn::Inserted(time, what));
    }

    fn wait(&mut self, time: u64, rank: u8, turn: Turn<W>) {
        self.arrivals += 1;
        self.waiting.push(Reverse(Waiting { order: (time, rank, self.arrivals), turn }));
    }

    /// Takes what the queues hold now.
    pub fn collect(&mut self) {
        for at in 0..self.incoming.len() {
            while let Ok(entry) = self.incoming[at].consumer.pop() {
                self.wait(entry.time, (self.rank)(&entry), Turn::Entry(entry));
            }
        }
    }

    /// What comes next in the order of time, if it is older than `before` (plant time, ns). An entry that comes later than
    /// younger ones keeps its own time and follows them.
    pub fn next(&mut self, before: u64) -> Option<Turn<W>> {
        let first = self.waiting.peek_mut()?;
        if first.0.order.0 >= before {
            return None;
        }
        Some(PeekMut::pop(first).0.turn)
    }

    /// The draft of the record that an entry is, with a time of plant time.
    pub fn draft(&self, entry: &Entry) -> Draft {
        Draft {
            time: entry.time,
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

    /// The record of a draft: the next number, the time since 1970.
    pub fn number(&mut self, draft: Draft) -> Record {
        self.seq += 1;
        let Draft { time, kind, source, transition, previous, current, priority, user, text } = draft;
        let time = self.epoch.saturating_add(time);
        Record { seq: self.seq, time, kind, source, transition, previous, current, priority, user, text }
    }
}

impl Router<Draft> {
    /// Takes what the queues hold and releases, in order of time, everything older than `before` (plant time, ns).
    pub fn release(&mut self, before: u64, mut to: impl FnMut(&Record)) {
        self.collect();
        while let Some(turn) = self.next(before) {
            let draft = match turn {
                Turn::Entry(entry) => self.draft(&entry),
                Turn::Inserted(_, draft) => draft,
            };
            to(&self.number(draft));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Kind, queue};

    #[test]
    fn entries_leave_by_time_across_queues() {
        let mut router: Router = Router::new(vec!["a".into(), "b".into()]);
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

    #[test]
    fn what_is_inserted_waits_for_its_turn_and_ranks_decide_within_a_moment() {
        let mut router = Router::<Draft>::new(vec!["a".into()]);
        let (mut a, ia) = queue(8, SourceId(0));
        router.add(ia);
        router.rank_by(|entry| if entry.transition == "first" { 0 } else { 1 });
        router.insert(3, Draft::new(3, Kind::Command, "b", "asked"));
        for (time, transition) in [(2, "x"), (3, "y"), (3, "first"), (4, "z")] {
            a.push(Entry::new(time, Kind::Event, SourceId(0), transition));
        }
        let mut seen = Vec::new();
        router.release(4, |r| seen.push(r.transition.to_string()));
        assert_eq!(seen, ["x", "first", "y", "asked"]);
    }
}
