//! Edges of one line of the kernel's character device: taken in batches, and what was lost between them.

use crate::gpio::errno;
use gpiocdev::Result;
use gpiocdev::line::EdgeKind;
use gpiocdev::request::Request;
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::io::Errno;
use std::os::fd::AsFd;

/// Words of one edge, and edges of one batch.
const WORDS: usize = 6;
const BATCH: usize = 64;

/// Where the edges of a batch are read to. One per lane is enough: they are handed on at once.
pub(crate) type Batch = [u64; BATCH * WORDS];

/// An empty batch.
pub(crate) const EMPTY: Batch = [0; BATCH * WORDS];

/// Reading must never block a lane.
pub(crate) fn never_block(request: &Request) -> std::io::Result<()> {
    Ok(fcntl_setfl(request.as_fd(), OFlags::NONBLOCK)?)
}

/// Takes a batch of edges that wait, oldest first, and hands on time stamp, level and the number of edges lost right before
/// each; true when there may be more. The library's `read_edge_event` is not used: it loses edges.
pub(crate) fn take(
    request: &Request,
    batch: &mut Batch,
    account: &mut Account,
    mut take: impl FnMut(u64, bool, u64),
) -> Result<bool> {
    let words = match request.read_edge_events_into_slice(batch) {
        Ok(words) => words,
        Err(error) => {
            return match errno(&error) {
                Some(Errno::AGAIN) => Ok(false),
                // A signal came first; nothing is lost.
                Some(Errno::INTR) => Ok(true),
                _ => Err(error),
            };
        }
    };
    for event in batch[..words.min(batch.len())].chunks_exact(WORDS) {
        let event = request.edge_event_from_slice(event)?;
        let level = event.kind == EdgeKind::Rising;
        take(event.timestamp_ns, level, account.missed(event.line_seqno, level));
    }
    Ok(words >= batch.len())
}

/// The account of one line's edges.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Account {
    /// Number of the last edge, as the kernel counts: from 1 at each request.
    last: u32,
    /// The level after it, where both kinds of edges are asked for.
    level: Option<bool>,
    both: bool,
}

impl Account {
    /// Of a line that was requested just now, with edges of both kinds or of one.
    pub(crate) fn new(both: bool) -> Self {
        Self { last: 0, level: None, both }
    }

    /// Edges that were lost right before this one, by two signs: a gap in the kernel's count tells of those its full buffer has
    /// pushed out. Two edges in turn with one level tell of a third between them: the kernel reads the level after the
    /// interrupt, and edges that come faster than that are one to it.
    fn missed(&mut self, count: u32, level: bool) -> u64 {
        let gap = u64::from(count.wrapping_sub(self.last).wrapping_sub(1));
        self.last = count;
        let before = if self.both { self.level.replace(level) } else { None };
        if gap == 0 && before == Some(level) { 1 } else { gap }
    }
}

#[cfg(test)]
mod tests {
    use super::Account;

    const UP: bool = true;
    const DOWN: bool = false;

    #[test]
    fn what_is_missing_between_two_edges() {
        for (what, both, last, edges) in [
            ("all are there", true, 0, &[(1, UP, 0), (2, DOWN, 0), (3, UP, 0)][..]),
            ("the first has no edge before it", true, 0, &[(1, DOWN, 0), (2, UP, 0)]),
            ("the first ones were pushed out", true, 0, &[(4, UP, 3)]),
            ("a gap", true, 7, &[(12, UP, 4), (13, DOWN, 0)]),
            ("merged: up, then down and up as one", true, 0, &[(1, UP, 0), (2, UP, 1), (3, DOWN, 0)]),
            ("merged twice", true, 0, &[(1, DOWN, 0), (2, DOWN, 1), (3, DOWN, 1)]),
            ("after a gap levels may be equal", true, 0, &[(1, UP, 0), (4, UP, 2), (5, UP, 1)]),
            ("one kind of edges has one level", false, 0, &[(1, UP, 0), (2, UP, 0), (4, UP, 1)]),
            ("the count begins anew", true, u32::MAX - 1, &[(u32::MAX, UP, 0), (0, DOWN, 0), (1, UP, 0)]),
            ("a gap where the count begins anew", true, u32::MAX, &[(2, UP, 2), (3, UP, 1)]),
        ] {
            let mut account = Account { last, ..Account::new(both) };
            for (count, level, missed) in edges {
                assert_eq!(account.missed(*count, *level), *missed, "{what}: edge {count}");
            }
        }
    }
}
