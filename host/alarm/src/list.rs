//! All alarms of a plant, and which of a group came first.

use crate::{Alarm, Input, Refusal, Rules, State, Transition};
use std::collections::HashMap;

/// What a transition was about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// Number of the alarm.
    pub alarm: usize,
    /// What happened to it.
    pub transition: Transition,
    /// Its code with the bits of run time, after it.
    pub code: u16,
    /// It is the first of its group since all of the group were normal.
    pub first_out: bool,
}

/// Why a list cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AlarmsError {
    /// Two alarms of one name.
    #[error("there are two alarms `{0}`")]
    Twice(String),
}

struct Member {
    name: String,
    rules: Rules,
    group: Option<usize>,
    alarm: Alarm,
}

/// The alarms of a plant, numbered as they were added.
#[derive(Default)]
pub struct Alarms {
    members: Vec<Member>,
    by_name: HashMap<String, usize>,
    groups: HashMap<String, usize>,
    /// By group: the alarm that came first.
    first: Vec<Option<usize>>,
}

impl Alarms {
    /// Adds an alarm, in a group if it is in one; its number.
    ///
    /// # Errors
    /// An alarm of this name is there already.
    pub fn add(&mut self, name: &str, rules: Rules, group: Option<&str>) -> Result<usize, AlarmsError> {
        let number = self.members.len();
        if self.by_name.insert(name.into(), number).is_some() {
            return Err(AlarmsError::Twice(name.into()));
        }
        let group = group.map(|group| {
            let next = self.first.len();
            let index = *self.groups.entry(group.into()).or_insert(next);
            if index == next {
                self.first.push(None);
            }
            index
        });
        self.members.push(Member { name: name.into(), rules, group, alarm: Alarm::default() });
        Ok(number)
    }

    /// Number of the alarm of a name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// Name of an alarm.
    pub fn name(&self, alarm: usize) -> &str {
        &self.members[alarm].name
    }

    /// Rules of an alarm.
    pub fn rules(&self, alarm: usize) -> &Rules {
        &self.members[alarm].rules
    }

    /// The alarm itself, as it stands.
    pub fn get(&self, alarm: usize) -> &Alarm {
        &self.members[alarm].alarm
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// Takes over the state of an alarm from an earlier run. Its condition is what the plant says now.
    pub fn restore(&mut self, alarm: usize, state: Alarm, first_out: bool) {
        let group = self.members[alarm].group;
        self.members[alarm].alarm = state;
        if let (true, true, Some(group)) = (first_out, state.state().is_listed(), group) {
            self.first[group] = Some(alarm);
        }
    }

    /// Ends shelves at `latest`, ns, that would end later: those of a run whose clock was ahead.
    pub fn limit_shelves(&mut self, latest: u64) {
        for member in &mut self.members {
            member.alarm.shelved = member.alarm.shelved.map(|until| until.min(latest));
        }
    }

    /// True for the alarm that came first in its group.
    pub fn is_first_out(&self, alarm: usize) -> bool {
        self.members[alarm].group.is_some_and(|g| self.first[g] == Some(alarm))
    }

    /// The alarms that are listed, with their states.
    pub fn listed(&self) -> impl Iterator<Item = (usize, State)> {
        self.members.iter().enumerate().map(|(n, m)| (n, m.alarm.state())).filter(|(_, state)| state.is_listed())
    }

    /// When [`Self::tick`] has something to do, ns.
    pub fn deadline(&self) -> Option<u64> {
        self.members.iter().filter_map(|m| m.alarm.deadline(&m.rules)).min()
    }

    /// Something happens to an alarm at `now`, ns.
    ///
    /// # Errors
    /// What an operator asked for and cannot have.
    pub fn step(&mut self, alarm: usize, input: Input, now: u64, mut told: impl FnMut(Change)) -> Result<(), Refusal> {
        let member = &mut self.members[alarm];
        let (rules, group) = (member.rules, member.group);
        let mut transitions = Vec::new();
        let done = member.alarm.step(&rules, input, now, |t| transitions.push(t));
        let last = transitions.len().saturating_sub(1);
        for (at, transition) in transitions.into_iter().enumerate() {
            if transition.word == "raised"
                && let Some(group) = group
            {
                self.first[group].get_or_insert(alarm);
            }
            // A group that is normal again has no first one any more.
            if let (true, Some(group)) = (at == last, group)
                && self.members.iter().all(|m| m.group != Some(group) || !m.alarm.state().is_listed())
            {
                self.first[group] = None;
            }
            let first_out = self.is_first_out(alarm);
            told(Change { alarm, transition, code: self.members[alarm].alarm.code(&rules), first_out });
        }
        done
    }

    /// Time has passed: delays and shelves that are over, the oldest first.
    pub fn tick(&mut self, now: u64, mut told: impl FnMut(Change)) {
        while let Some((due, alarm)) = (0..self.members.len())
            .filter_map(|n| Some((self.members[n].alarm.deadline(&self.members[n].rules)?, n)))
            .min()
            .filter(|(due, _)| *due <= now)
        {
            // A tick is never refused.
            let _ = self.step(alarm, Input::Tick, due, &mut told);
        }
    }
}
