//! The list of alarms as operators see it.

use super::Annunciator;
use crate::operate::AlarmRow;
use latchwork_alarm::State;

impl Annunciator {
    /// The alarms: all, or those that are listed or hidden; the most urgent first, then the newest.
    pub(crate) fn rows(&self, all: bool) -> Vec<AlarmRow> {
        let numbers = (0..self.alarms.len()).filter(|n| all || self.alarms.get(*n).state() != State::Normal);
        let mut rows: Vec<_> = numbers.map(|n| self.row(n)).collect();
        let listed = |row: &AlarmRow| !matches!(row.state, "shelved" | "suppressed" | "out-of-service" | "normal");
        rows.sort_by_key(|row| (!listed(row), u8::MAX - row.priority, u64::MAX - row.raised, row.alarm.clone()));
        rows
    }

    /// How many are listed, and how many of them wait for an acknowledgement.
    pub(crate) fn counts(&self) -> (usize, usize) {
        let waits = |state: State| matches!(state, State::Unacknowledged | State::Returned);
        self.alarms.listed().fold((0, 0), |(listed, unacknowledged), (_, state)| {
            (listed + 1, unacknowledged + usize::from(waits(state)))
        })
    }

    fn row(&self, alarm: usize) -> AlarmRow {
        let (state, member) = (self.alarms.get(alarm), &self.members[alarm]);
        AlarmRow {
            alarm: self.alarms.name(alarm).to_owned(),
            text: member.text.clone(),
            state: state.state().name(),
            priority: member.priority,
            code: if member.coded { state.code(self.alarms.rules(alarm)) } else { 0 },
            group: member.group.clone().unwrap_or_default(),
            first_out: self.alarms.is_first_out(alarm),
            condition: state.condition,
            quality: "good",
            raised: member.raised,
            shelved_until: state.shelved.unwrap_or(0),
            seq: member.seq,
        }
    }
}
