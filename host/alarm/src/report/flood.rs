//! Floods: when alarms come faster than an operator can deal with them.

use super::{FLOOD_BEGINS, FLOOD_ENDS, TEN_MINUTES};

/// A flood: from the first of more than ten alarms in ten minutes until there are fewer than five in ten minutes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flood {
    /// When the first of its alarms was raised, ns since 1970.
    pub start: u64,
    /// When it was over, ns since 1970; the end of the report for one that was not.
    pub end: u64,
    /// Alarms raised in it.
    pub count: u64,
    /// It was not over at the end.
    pub open: bool,
}

/// Finds floods while alarms come, in the order of time.
#[derive(Debug, Default)]
pub(super) struct Floods {
    /// The last raises, ns: number `n` stands at `n % recent.len()`.
    recent: [u64; FLOOD_BEGINS + 1],
    /// Raises so far, since the clock was set back last.
    raised: usize,
    /// Start of the flood that goes on, and its alarms.
    open: Option<(u64, u64)>,
    /// End of the last one.
    ended: u64,
    pub(super) found: Vec<Flood>,
}

impl Floods {
    /// An alarm is raised at a time, ns.
    pub(super) fn raise(&mut self, time: u64) {
        let last = self.last(1).unwrap_or(0);
        if time + TEN_MINUTES < last {
            self.close(last);
            (self.raised, self.ended) = (0, 0);
        }
        // Lanes may be a little out of order.
        let time = time.max(self.last(1).unwrap_or(0));
        if self.open.is_some() && self.over() < time {
            self.close(self.over());
        }
        self.recent[self.raised % self.recent.len()] = time;
        self.raised += 1;
        if let Some((_, count)) = &mut self.open {
            *count += 1;
        } else if self.last(FLOOD_BEGINS + 1).is_some_and(|first| first + TEN_MINUTES > time) {
            // Those before the end of the last flood were counted in it.
            let of_this = |n: &usize| self.last(*n).is_some_and(|t| t >= self.ended);
            let count = (1..=FLOOD_BEGINS + 1).take_while(of_this).count();
            self.open = self.last(count).map(|start| (start, count as u64));
        }
    }

    /// The report ends, ns.
    pub(super) fn finish(&mut self, to: u64) {
        let (over, open) = (self.over(), self.open.is_some());
        self.close(over.min(to));
        if let (true, Some(flood)) = (open, self.found.last_mut()) {
            flood.open = over > to;
        }
    }

    /// When there will be fewer than five in ten minutes if no more come.
    fn over(&self) -> u64 {
        self.last(FLOOD_ENDS).unwrap_or(0) + TEN_MINUTES
    }

    /// The time of the `n`-th raise from the last one, which is number 1.
    fn last(&self, n: usize) -> Option<u64> {
        (self.raised >= n && n > 0).then(|| self.recent[(self.raised - n) % self.recent.len()])
    }

    fn close(&mut self, end: u64) {
        // What is raised at the very moment at which there are fewer than five comes after it.
        let after = (1..FLOOD_ENDS).take_while(|n| self.last(*n).is_some_and(|t| t >= self.over())).count() as u64;
        if let Some((start, count)) = self.open.take().map(|(start, count)| (start, count - after)) {
            self.found.push(Flood { start, end, count, open: false });
            self.ended = end;
        }
    }
}
