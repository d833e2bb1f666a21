//! What operators do about alarms.

use super::{Annunciator, Told};
use crate::operate::{Operation, Operator, Refused};
use globset::{Glob, GlobMatcher};
use latchwork_alarm::{Input, Refusal};
use latchwork_image::nearest;
use latchwork_record::{Draft, Kind};

/// What an operator wants of alarms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AlarmWish {
    /// Names: an alarm, or a glob.
    names: String,
    /// An alarm raised after this record is not acknowledged.
    seen: Option<u64>,
    what: What,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    Acknowledge,
    Reset,
    /// For so long, ns.
    Shelve(u64),
    Unshelve,
    OutOfService(bool),
}

impl AlarmWish {
    /// The part of an operation that is about alarms.
    pub(crate) fn new(operation: &Operation) -> Option<Self> {
        let (names, seen, what) = match operation {
            Operation::Acknowledge { alarm, seen } => (alarm, *seen, What::Acknowledge),
            Operation::Reset { alarm } => (alarm, None, What::Reset),
            Operation::Shelve { alarm, duration } => (alarm, None, What::Shelve(*duration)),
            Operation::Unshelve { alarm } => (alarm, None, What::Unshelve),
            Operation::OutOfService { alarm, out } => (alarm, None, What::OutOfService(*out)),
            _ => return None,
        };
        Some(Self { names: names.clone(), seen, what })
    }

    fn verb(&self) -> &'static str {
        match self.what {
            What::Acknowledge => "acknowledge",
            What::Reset => "reset",
            What::Shelve(_) => "shelve",
            What::Unshelve => "unshelve",
            What::OutOfService(true) => "out-of-service",
            What::OutOfService(false) => "in-service",
        }
    }
}

impl Annunciator {
    /// Does what an operator wants, at plant time `now`, ns; what was refused is told, too.
    pub(crate) fn operate(
        &mut self,
        wish: &AlarmWish,
        operator: &Operator,
        now: u64,
        told: &mut Vec<Told>,
        refused: &mut Vec<Draft>,
    ) -> Result<Vec<String>, Refused> {
        let chosen = self.chosen(&wish.names)?;
        // A glob means those of its alarms to which it can be done; a name means that one.
        let by_name = chosen.len() == 1 && self.alarms.name(chosen[0]) == wish.names;
        let (mut done, mut why) = (Vec::new(), Vec::new());
        for alarm in chosen {
            let before = told.len();
            match self.wish(alarm, wish, operator, now, told) {
                Ok(()) => {
                    // Not what only time has done.
                    for told in told[before..].iter_mut().filter(|t| !t.draft.user.is_empty()) {
                        remark(&mut told.draft, operator);
                    }
                    let state = self.alarms.get(alarm).state().name();
                    done.push(format!("{}: {}, it is {state} now", self.alarms.name(alarm), wish.verb()));
                }
                Err(sentence) => {
                    why.push((alarm, sentence));
                }
            }
        }
        if by_name || done.is_empty() {
            for (alarm, sentence) in &why {
                if by_name {
                    refused.push(self.refusal(*alarm, wish, operator, now, sentence));
                }
            }
            if let Some((alarm, sentence)) = why.first() {
                let more = if why.len() > 1 { format!(" (and {} others)", why.len() - 1) } else { String::new() };
                let message = format!("`{}`: {sentence}{more}", self.alarms.name(*alarm));
                return Err(Refused::new("state", message));
            }
        }
        Ok(done)
    }

    fn wish(
        &mut self,
        alarm: usize,
        wish: &AlarmWish,
        operator: &Operator,
        now: u64,
        told: &mut Vec<Told>,
    ) -> Result<(), String> {
        let member = &self.members[alarm];
        if let Some(seen) = wish.seen
            && member.raised_seq > seen
        {
            return Err(format!(
                "it was raised anew by record {} after what you have seen; look at it again",
                member.raised_seq
            ));
        }
        let now = self.epoch.saturating_add(now);
        let input = match wish.what {
            What::Acknowledge => Input::Acknowledge,
            What::Reset => Input::Reset,
            What::Shelve(duration) => Input::Shelve(now.saturating_add(duration)),
            What::Unshelve => Input::Unshelve,
            What::OutOfService(out) => Input::OutOfService(out),
        };
        self.step(alarm, input, now, &operator.user, told).map_err(|refusal: Refusal| refusal.to_string())
    }

    /// The record of a wish that was refused.
    fn refusal(&self, alarm: usize, wish: &AlarmWish, operator: &Operator, now: u64, why: &str) -> Draft {
        let mut draft = Draft::new(now, Kind::Command, self.alarms.name(alarm), "refused");
        draft.user.clone_from(&operator.user);
        draft.priority = 32;
        draft.text = format!("{}: {why}", wish.verb());
        remark(&mut draft, operator);
        draft
    }

    fn chosen(&self, names: &str) -> Result<Vec<usize>, Refused> {
        if let Some(alarm) = self.alarms.find(names) {
            return Ok(vec![alarm]);
        }
        let unknown = || {
            let known = (0..self.alarms.len()).map(|n| self.alarms.name(n));
            let hint = nearest(names, known).map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
            Refused::new("unknown", format!("there is no alarm `{names}`{hint}"))
        };
        if !names.contains(['*', '?', '[', '{']) {
            return Err(unknown());
        }
        let glob: GlobMatcher = Glob::new(names)
            .map_err(|e| Refused::new("value", format!("`{names}` is no glob of alarms: {}", e.kind())))?
            .compile_matcher();
        let chosen: Vec<_> = (0..self.alarms.len()).filter(|n| glob.is_match(self.alarms.name(*n))).collect();
        if chosen.is_empty() { Err(unknown()) } else { Ok(chosen) }
    }
}

/// Says where a wish came from and why.
pub(crate) fn remark(draft: &mut Draft, operator: &Operator) {
    let mut say = |what: &str, how: &str| {
        if !how.is_empty() {
            let between = if draft.text.is_empty() { "" } else { "; " };
            draft.text += &format!("{between}{what} {how}");
        }
    };
    say("from", &operator.origin);
    say("because", &operator.reason);
}
