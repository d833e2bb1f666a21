//! One alarm that is raised again and again.

use super::CHATTERING;

/// The last raises of an alarm, and what they came to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Chatter {
    /// The last two raises, ns, the older one first; and whether each counts as chattering already.
    before: [Option<(u64, bool)>; 2],
    /// Raises that were one of three within a minute.
    pub(super) raised: u64,
    /// Runs of such.
    pub(super) runs: u64,
    /// The shortest time of three raises, ns.
    pub(super) fastest: Option<u64>,
}

impl Chatter {
    /// The alarm is raised at a time, ns.
    pub(super) fn raise(&mut self, time: u64) {
        // A clock that was set back says nothing of how much time has passed.
        if self.before[1].is_some_and(|(last, _)| time < last) {
            self.before = [None; 2];
        }
        let mut counts = false;
        if let [Some((first, a)), Some((second, b))] = self.before
            && time - first <= CHATTERING
        {
            self.raised += u64::from(!a) + u64::from(!b) + 1;
            self.runs += u64::from(!a && !b);
            self.fastest = Some(self.fastest.map_or(time - first, |f| f.min(time - first)));
            self.before[1] = Some((second, true));
            counts = true;
        }
        self.before = [self.before[1], Some((time, counts))];
    }
}
