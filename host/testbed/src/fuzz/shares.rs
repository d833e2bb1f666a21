//! How the time of a search is shared: what looking closer at one thing takes is bounded, so that the others are found too.

/// What a search does however late it is: so many executions, or sequences where an execution may never end.
const LEAST_EXECUTIONS: u64 = 256;
const LEAST_SEQUENCES: u64 = 16;
/// Parts of the time that looking closer may take: a half in all, a quarter for one thing.
const ALL: u64 = 2;
const ONE: u64 = 4;

/// The time of a search, as far as it is gone.
pub(super) struct Shares<'a> {
    clock: &'a dyn Fn() -> u64,
    begun: u64,
    time: Option<u64>,
    /// Spent on looking closer, ns.
    closer: u64,
}

/// A closer look at one thing.
#[derive(Clone, Copy)]
pub(super) struct Look<'a> {
    clock: &'a dyn Fn() -> u64,
    begun: u64,
    until: Option<u64>,
}

impl<'a> Shares<'a> {
    /// Begins now. `time`: ns; without it nothing is ever late.
    pub(super) fn new(clock: &'a dyn Fn() -> u64, time: Option<u64>) -> Self {
        Self { clock, begun: clock(), time, closer: 0 }
    }

    /// Since the begin, ns.
    pub(super) fn passed(&self) -> u64 {
        (self.clock)().saturating_sub(self.begun)
    }

    /// Since the begin without closer looks, ns.
    pub(super) fn searching(&self) -> u64 {
        self.passed().saturating_sub(self.closer)
    }

    /// The time is over, and the least is done.
    pub(super) fn over(&self, executions: u64, sequences: u64) -> bool {
        let least = executions >= LEAST_EXECUTIONS || sequences >= LEAST_SEQUENCES;
        least && self.time.is_some_and(|time| self.passed() >= time)
    }

    /// A closer look begins.
    pub(super) fn look(&self) -> Look<'a> {
        let begun = (self.clock)();
        let left = |time: u64| (time / ONE).min((time / ALL).saturating_sub(self.closer));
        Look { clock: self.clock, begun, until: self.time.map(|time| begun.saturating_add(left(time))) }
    }

    /// A closer look is over.
    pub(super) fn looked(&mut self, look: Look<'_>) {
        self.closer = self.closer.saturating_add((self.clock)().saturating_sub(look.begun));
    }
}

impl Look<'_> {
    /// Its time is over.
    pub(super) fn late(&self) -> bool {
        self.until.is_some_and(|until| (self.clock)() >= until)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// How long the closer looks of a search may take, when each takes all that it may.
    fn looks(time: Option<u64>, count: usize) -> Vec<Option<u64>> {
        let now = Cell::new(1_000);
        let clock = || now.get();
        let mut shares = Shares::new(&clock, time);
        let mut all = Vec::new();
        for _ in 0..count {
            let look = shares.look();
            all.push(look.until.map(|until| until - now.get()));
            now.set(look.until.unwrap_or(now.get() + 1_000_000));
            assert_eq!(look.late(), time.is_some());
            shares.looked(look);
        }
        all
    }

    #[test]
    fn one_look_takes_at_most_a_quarter_and_all_take_at_most_a_half_of_the_time() {
        assert_eq!(looks(Some(800), 4), [Some(200), Some(200), Some(0), Some(0)]);
        assert_eq!(looks(None, 2), [None, None], "a search by number is the same on every machine");
    }

    #[test]
    fn a_look_that_ended_late_is_paid_by_those_after_it() {
        let now = Cell::new(0);
        let clock = || now.get();
        let mut shares = Shares::new(&clock, Some(800));
        let look = shares.look();
        now.set(350);
        shares.looked(look);
        assert_eq!(shares.look().until, Some(350 + 50));
    }

    #[test]
    fn a_search_does_the_least_however_late_it_is() {
        let now = Cell::new(0);
        let clock = || now.get();
        let shares = Shares::new(&clock, Some(800));
        now.set(799);
        assert!(!shares.over(LEAST_EXECUTIONS, LEAST_SEQUENCES), "there is time left");
        now.set(800_000);
        assert!(!shares.over(LEAST_EXECUTIONS - 1, LEAST_SEQUENCES - 1));
        assert!(shares.over(LEAST_EXECUTIONS, 1));
        assert!(shares.over(0, LEAST_SEQUENCES), "what never ends has no execution");
    }
}
