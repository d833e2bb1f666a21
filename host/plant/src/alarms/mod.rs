//! The annunciator: conditions of the plant become the life of alarms, in the order of time, off the lanes.
//!
//! A lane tells only that a condition came or went. Here, between the router's order and the numbering of records, it goes
//! through the alarm's state machine; delays and shelves end at their own times, so that a run at virtual time is the
//! same every time.
//!
//! ```text
//! lane ──condition──► Router ──in the order of time──► Annunciator ──one draft per transition──► Record, with the state it keeps
//! operator ──wish──► Router ─┘
//! ```

mod keep;
mod list;
mod operate;

pub use keep::{Restored, StateError};
pub use operate::AlarmWish;
pub(crate) use operate::remark;

use crate::model::{Model, Variable};
use latchwork_alarm::{Alarm, Alarms, Change, CodeKind, Input, Refusal, Rules};
use latchwork_image::Value;
use latchwork_record::{Draft, Entry, Kept, Kind, Record, SourceId};
use std::collections::HashMap;

/// Transition of an entry about a watched tag that is a condition.
pub const CONDITION: &str = "condition";
/// Transition of an entry about a watched tag that suppresses alarms.
pub const SUPPRESSING: &str = "suppressing";
/// Priority of an alarm that no rule gives one.
const PRIORITY: u8 = 128;

/// Suppression goes before what it suppresses where both come at the same time.
pub(crate) fn rank(entry: &Entry) -> u8 {
    u8::from(!(entry.kind == Kind::Alarm && entry.transition == SUPPRESSING))
}

/// So long the condition of an alarm waits at most to hear whether it is suppressed, ns.
const PATIENCE: u64 = 1_000_000_000;
/// Longest shelf that an earlier run may leave, ns: its clock may have been ahead.
const LONGEST_SHELF: u64 = 7 * 24 * 3600 * 1_000_000_000;

/// What a source of entries is to the alarms.
#[derive(Clone, Debug)]
enum Role {
    /// The condition of an alarm.
    Condition(usize),
    /// It suppresses alarms.
    Suppresses(Vec<usize>),
}

/// What is known of an alarm besides its life.
struct Member {
    priority: u8,
    text: String,
    group: Option<String>,
    /// It has a rule.
    coded: bool,
    /// What suppresses it has not spoken yet: until then its condition waits.
    unheard: bool,
    /// The condition that waits, and since when, ns since 1970.
    held: Option<(bool, u64)>,
    /// When it was raised last, ns since 1970; 0: never.
    raised: u64,
    /// Number of the record that said so.
    raised_seq: u64,
    /// Number of the record of its last transition.
    seq: u64,
}

/// A draft about an alarm, and which alarm.
pub(crate) struct Told {
    pub(crate) draft: Draft,
    pub(crate) alarm: usize,
    /// What is to be kept of the alarm with the record.
    pub(crate) after: After,
}

/// An alarm after a transition.
pub(crate) struct After {
    alarm: Alarm,
    first_out: bool,
}

/// All alarms of a plant with their life.
pub struct Annunciator {
    alarms: Alarms,
    members: Vec<Member>,
    by_source: HashMap<SourceId, Role>,
    /// When plant time 0 was, ns since 1970: alarms live by absolute time, because shelves outlive a run.
    epoch: u64,
    /// When something is due by itself, ns since 1970.
    due: Option<u64>,
}

impl Annunciator {
    /// The alarms of a model, without the sources of their conditions.
    pub(crate) fn new(model: &Model) -> Self {
        let (alarms, members, by_source) = (Alarms::default(), Vec::new(), HashMap::new());
        let mut all = Self { alarms, members, by_source, epoch: 0, due: None };
        model.variables.iter().filter(|v| !v.is_command()).for_each(|variable| all.add(model, variable));
        all
    }

    /// Adds the alarm of a variable, normal.
    pub(crate) fn add(&mut self, model: &Model, variable: &Variable) {
        let rule = variable.rule.map(|r| &model.alarm_rules[r]);
        let rules = rule.map_or(Rules { kind: CodeKind::Alarm, on_delay: 0, off_delay: 0 }, |r| Rules {
            kind: r.code,
            on_delay: r.on_delay,
            off_delay: r.off_delay,
        });
        // Names of tags are unique.
        if self.alarms.add(&variable.name, rules, variable.group.as_deref()).is_err() {
            return;
        }
        self.members.push(Member {
            priority: rule.map_or(PRIORITY, |r| r.priority),
            text: variable.text.clone(),
            group: variable.group.clone(),
            coded: rule.is_some(),
            unheard: false,
            held: None,
            raised: 0,
            raised_seq: 0,
            seq: 0,
        });
    }

    /// Number of the alarm of a variable.
    pub(crate) fn find(&self, variable: &Variable) -> Option<usize> {
        self.alarms.find(&variable.name)
    }

    /// Entries of this source are the condition of an alarm.
    pub(crate) fn listen(&mut self, source: SourceId, alarm: usize) {
        self.by_source.insert(source, Role::Condition(alarm));
    }

    /// Entries of this source suppress alarms.
    pub(crate) fn suppress(&mut self, source: SourceId, alarms: Vec<usize>) {
        alarms.iter().for_each(|alarm| self.members[*alarm].unheard = true);
        self.by_source.insert(source, Role::Suppresses(alarms));
    }

    /// Sets when plant time 0 was, ns since 1970; after the alarms of an earlier run were restored, or before.
    pub(crate) fn set_epoch(&mut self, epoch: u64) {
        self.epoch = epoch;
        self.alarms.limit_shelves(epoch.saturating_add(LONGEST_SHELF));
        self.settle_due();
    }

    fn settle_due(&mut self) {
        let held = self.members.iter().filter_map(|m| Some(m.held?.1.saturating_add(PATIENCE)));
        self.due = held.chain(self.alarms.deadline()).min();
    }

    /// What an entry means to the alarms; false when it is none of theirs.
    pub(crate) fn entry(&mut self, entry: &Entry, told: &mut Vec<Told>) -> bool {
        if entry.kind != Kind::Alarm {
            return false;
        }
        let Some(role) = self.by_source.get(&entry.source).cloned() else { return false };
        let on = entry.current == latchwork_record::Datum::Boolean(true);
        let now = self.epoch.saturating_add(entry.time);
        match role {
            Role::Condition(alarm) if self.members[alarm].unheard => {
                self.members[alarm].held = Some((on, now));
                self.settle_due();
            }
            Role::Condition(alarm) => drop(self.step(alarm, Input::Condition(on), now, "", told)),
            Role::Suppresses(alarms) => {
                for alarm in alarms {
                    // A condition of the plant is never refused.
                    let _ = self.step(alarm, Input::Suppress(on), now, "", told);
                    self.heard(alarm, now, told);
                }
            }
        }
        true
    }

    /// What suppresses an alarm has spoken, or will not: its condition waits no longer.
    fn heard(&mut self, alarm: usize, now: u64, told: &mut Vec<Told>) {
        self.members[alarm].unheard = false;
        if let Some((on, _)) = self.members[alarm].held.take() {
            let _ = self.step(alarm, Input::Condition(on), now, "", told);
        }
    }

    /// True when something is due by itself at plant time `now`, ns, or was before.
    pub(crate) fn is_due(&self, now: u64) -> bool {
        self.due.is_some_and(|due| due <= self.epoch.saturating_add(now))
    }

    /// Delays and shelves that are over at plant time `now`, ns.
    pub(crate) fn tick(&mut self, now: u64, told: &mut Vec<Told>) {
        let mut changes = Vec::new();
        let now = self.epoch.saturating_add(now);
        for alarm in 0..self.members.len() {
            // The lane of what suppresses it does not run: an alarm too many is better than none.
            if self.members[alarm].held.is_some_and(|(_, since)| since.saturating_add(PATIENCE) <= now) {
                self.heard(alarm, now, told);
            }
        }
        self.alarms.tick(now, |change| changes.push(change));
        told.extend(changes.iter().map(|change| self.told(change, "")));
        self.settle_due();
    }

    fn step(&mut self, alarm: usize, input: Input, now: u64, user: &str, told: &mut Vec<Told>) -> Result<(), Refusal> {
        let mut changes = Vec::new();
        let done = self.alarms.step(alarm, input, now, |change| changes.push(change));
        told.extend(changes.iter().map(|change| self.told(change, user)));
        self.settle_due();
        done
    }

    fn told(&self, change: &Change, user: &str) -> Told {
        let member = &self.members[change.alarm];
        let kind = if self.alarms.rules(change.alarm).kind == CodeKind::Message { Kind::Message } else { Kind::Alarm };
        let transition = change.transition;
        let mut text = member.text.clone();
        if let (true, "raised", Some(group)) = (change.first_out, transition.word, &member.group) {
            let space = if text.is_empty() { "" } else { " " };
            text += &format!("{space}(the first of group {group})");
        }
        let by_itself = matches!(transition.word, "raised" | "returned" | "shelf-over" | "suppressed" | "unsuppressed");
        let draft = Draft {
            time: transition.time.saturating_sub(self.epoch),
            kind,
            source: self.alarms.name(change.alarm).to_owned(),
            transition: transition.word.into(),
            previous: Value::Text(transition.from.name().into()),
            current: Value::Text(transition.to.name().into()),
            priority: member.priority,
            user: if by_itself { String::new() } else { user.to_owned() },
            text,
        };
        let after = After { alarm: transition.after, first_out: change.first_out };
        Told { draft, alarm: change.alarm, after }
    }

    /// The record that a transition has become; what is to be kept with it.
    pub(crate) fn recorded(&mut self, alarm: usize, after: &After, record: &Record) -> Kept {
        let member = &mut self.members[alarm];
        member.seq = record.seq;
        if record.transition == "raised" {
            (member.raised, member.raised_seq) = (record.time, record.seq);
        }
        self.keep(alarm, after)
    }
}
