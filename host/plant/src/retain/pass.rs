//! How far a lane is with its saves: one block at a time, in rounds, and what a swap wants before that.

use std::collections::VecDeque;

/// The saves of a lane. Members are numbers.
#[derive(Default)]
pub(super) struct Pass {
    members: Vec<usize>,
    /// The next one of the round; their number when all were.
    at: usize,
    /// To be saved before the round goes on.
    first: VecDeque<usize>,
    /// Who is asked now, and whether that was to be at once.
    asked: Option<(usize, bool)>,
}

impl Pass {
    /// Before the first round.
    pub(super) fn new(members: Vec<usize>) -> Self {
        Self { at: members.len(), members, ..Self::default() }
    }

    /// A round begins; one that is under way goes on.
    pub(super) fn begin(&mut self) {
        if self.over() {
            self.at = 0;
        }
    }

    /// The round is over.
    pub(super) fn over(&self) -> bool {
        self.at >= self.members.len()
    }

    /// A member is to be saved next, whatever the round is at.
    pub(super) fn at_once(&mut self, member: usize) {
        if !self.first.contains(&member) {
            self.first.push_back(member);
        }
    }

    /// Who is to be asked, or is.
    pub(super) fn next(&self) -> Option<usize> {
        let next = || self.first.front().or_else(|| self.members.get(self.at)).copied();
        self.who_is_asked().or_else(next)
    }

    /// The next one has nothing to save.
    pub(super) fn skip(&mut self) {
        self.ask();
        self.answered(false);
    }

    /// The next one is asked.
    pub(super) fn ask(&mut self) {
        self.asked = self.next().map(|member| (member, !self.first.is_empty()));
        // Whatever comes for it from now on is one more wish.
        self.first.pop_front();
    }

    /// Somebody is asked.
    pub(super) fn asked(&self) -> bool {
        self.asked.is_some()
    }

    pub(super) fn who_is_asked(&self) -> Option<usize> {
        self.asked.map(|(member, _)| member)
    }

    /// It has answered; one that was `busy` is asked again. True when it was to be at once.
    pub(super) fn answered(&mut self, busy: bool) -> bool {
        match self.asked.take() {
            Some((member, true)) => {
                if busy {
                    self.first.push_front(member);
                }
                true
            }
            Some((_, false)) => {
                self.at += usize::from(!busy);
                false
            }
            None => false,
        }
    }

    /// The lane has ended: nobody answers any more.
    pub(super) fn end(&mut self) {
        (self.at, self.asked) = (self.members.len(), None);
        self.first.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The next ones, each answered at once.
    fn asked(pass: &mut Pass) -> Vec<usize> {
        let mut all = Vec::new();
        while let Some(next) = pass.next() {
            pass.ask();
            pass.answered(false);
            all.push(next);
        }
        all
    }

    #[test]
    fn what_is_wanted_at_once_comes_before_the_rest_of_a_round_that_goes_on_after_it() {
        let mut pass = Pass::new(vec![3, 5, 8]);
        assert_eq!(pass.next(), None);
        pass.begin();
        pass.ask();
        // Member 3 is asked; it and another one are wanted at once, and again.
        pass.at_once(3);
        pass.at_once(8);
        pass.at_once(3);
        assert_eq!((pass.next(), pass.answered(false)), (Some(3), false));
        assert_eq!(asked(&mut pass), [3, 8, 5, 8]);
        assert!(pass.over());
    }

    #[test]
    fn one_that_is_busy_is_asked_again_in_the_same_place() {
        let mut pass = Pass::new(vec![1, 2]);
        pass.begin();
        pass.at_once(2);
        pass.ask();
        assert!(pass.answered(true));
        pass.ask();
        assert!(pass.answered(false));
        pass.ask();
        assert!(!pass.answered(true));
        assert_eq!(asked(&mut pass), [1, 2]);
    }

    #[test]
    fn a_round_goes_on_where_it_was_and_ends_with_its_lane() {
        let mut pass = Pass::new(vec![1, 2]);
        pass.begin();
        pass.skip();
        pass.begin();
        assert_eq!(pass.next(), Some(2));
        pass.ask();
        pass.at_once(1);
        pass.end();
        assert_eq!((pass.next(), pass.over(), pass.asked()), (None, true, false));
    }
}
