//! What operators do about alarms.

use super::{Annunciator, Told};
use crate::operate::{Operation, Operator, Refused};
use globset::{Glob, GlobMatcher};
use latchwork_alarm::{Input, Refusal};
use latchwork_image::nearest;
use latchwork_record::Draft;

/// Why an alarm is not acknowledged that nobody has seen.
const ANEW: &str = "raised anew";

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
}

impl Annunciator {
    /// Does what an operator wants, at plant time `now`, ns. A glob means those of its alarms to which it can be done.
    ///
    /// # Errors
    /// No such alarm; none to which it can be done, and why.
    pub(crate) fn operate(
        &mut self,
        wish: &AlarmWish,
        operator: &Operator,
        now: u64,
        told: &mut Vec<Told>,
    ) -> Result<Vec<String>, Refused> {
        let (mut done, mut refused) = (Vec::new(), Vec::new());
        for alarm in self.chosen(&wish.names)? {
            let before = told.len();
            let name = self.alarms.name(alarm).to_owned();
            match self.wish(alarm, wish, operator, now, told) {
                Ok(()) => done.push(format!("{name} is {} now", self.alarms.get(alarm).state().name())),
                Err(why) => refused.push(format!("`{name}`: {why}")),
            }
            // Not what only time has done.
            for told in told[before..].iter_mut().filter(|t| !t.draft.user.is_empty()) {
                remark(&mut told.draft, operator);
            }
        }
        match refused.first() {
            Some(first) if done.is_empty() => {
                let more = refused.len() - 1;
                let others = if more > 0 { format!(" (and {more} others)") } else { String::new() };
                Err(Refused::new("state", format!("{first}{others}")))
            }
            _ => {
                // What came after the operator has looked is not passed over in silence.
                done.extend(refused.into_iter().filter(|why| why.contains(ANEW)).map(|why| format!("not done: {why}")));
                Ok(done)
            }
        }
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
                "it was {ANEW} by record {} after what you have seen; look at it again",
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
