//! Which records: by number, time, kind, priority, source.

use crate::Kind;

/// A set of kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KindSet(u16);

impl KindSet {
    /// Every kind.
    pub const ALL: Self = Self((1 << Kind::ALL.len()) - 1);

    /// True for a kind in it.
    pub fn contains(self, kind: Kind) -> bool {
        self.0 >> kind as u8 & 1 == 1
    }

    pub(super) fn bits(self) -> u16 {
        self.0
    }
}

impl FromIterator<Kind> for KindSet {
    fn from_iter<I: IntoIterator<Item = Kind>>(kinds: I) -> Self {
        Self(kinds.into_iter().fold(0, |bits, kind| bits | 1 << kind as u8))
    }
}

/// Which records; the default is all.
#[derive(Clone, Copy)]
pub struct Query<'a> {
    /// Numbers above this one.
    pub after: u64,
    /// Numbers up to this one.
    pub until: u64,
    /// Not older than this, ns since 1970.
    pub from: u64,
    /// Older than this, ns since 1970.
    pub to: u64,
    /// Of these kinds.
    pub kinds: KindSet,
    /// Of at least this priority.
    pub priority: u8,
    /// Of sources that this says yes to.
    pub source: Option<&'a dyn Fn(&str) -> bool>,
}

impl Default for Query<'_> {
    fn default() -> Self {
        Self { after: 0, until: u64::MAX, from: 0, to: u64::MAX, kinds: KindSet::ALL, priority: 0, source: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_has_what_it_was_made_of() {
        let set: KindSet = [Kind::Alarm, Kind::Lost].into_iter().collect();
        let has = |set: KindSet| Kind::ALL.into_iter().filter(|k| set.contains(*k)).collect::<Vec<_>>();
        assert_eq!(has(set), [Kind::Alarm, Kind::Lost]);
        assert_eq!(has(KindSet::ALL), Kind::ALL);
    }
}
