//! Wishes are heard between two looks at the plant, and answered when they are done.

use super::{Answer, Console, Operation, Operator, Pending, Refused, Wish, console};
use crate::alarms::{AlarmWish, remark};
use crate::assemble::Plant;
use crate::lane::Report;
use crate::sim::Action;
use latchwork_record::{Draft, Kept, Kind};

/// Priority of a record of what an operator did.
const PRIORITY: u8 = 32;
/// Wishes heard in one turn at most; one that reads ends it.
const WISHES: usize = 16;
/// Priority of a record of what an operator must not do.
const FORBIDDEN: u8 = 128;

impl Plant {
    /// The operators' way to this plant.
    pub fn console(&mut self) -> Console {
        let (console, wishes) = console();
        self.desk.wishes = Some(wishes);
        console
    }

    /// Sets when plant time 0 was, ns since 1970. Virtual time leaves it at 0, so that two runs are equal.
    pub fn set_epoch(&mut self, epoch: u64) {
        self.router.set_epoch(epoch);
        self.annunciator.set_epoch(epoch);
    }

    /// Does what a row of the stimulus says, at plant time `now`, ns.
    pub fn stimulate(&mut self, action: &Action, now: u64) {
        match action {
            Action::Point { place, cell } => self.sim.set(*place, *cell, now),
            Action::Signal { place, cell, quality } => self.sim.signal(*place, *cell, *quality, now),
            Action::Command { block, bit, set } => self.stimulate_command(*block, *bit, *set),
            Action::Operate(operation) => {
                let operator = Operator { user: "stimulus".into(), origin: "stimulus".into(), reason: String::new() };
                self.wish(Pending::unanswered(operator, operation.clone()), now);
            }
        }
    }

    /// Hears all wishes that wait and what the lanes said to earlier ones, at plant time `now`, ns.
    pub fn serve(&mut self, now: u64) {
        // Not all at once: whoever reads much must not keep the lanes' queues from being emptied.
        for _ in 0..WISHES {
            let Some(pending) = self.desk.wishes.as_ref().and_then(|w| w.next()) else { break };
            let reads = matches!(pending.operation, Operation::Read { .. } | Operation::Alarms { .. });
            if !pending.given_up() {
                self.wish(pending, now);
                self.router.collect();
            }
            if reads {
                break;
            }
        }
        self.configured(now);
        self.lane_reports(now);
        self.swap_turn(now);
        self.retain_turn(now);
        self.recorder_turn(now);
        self.supervise(now);
    }

    /// What the lanes sent back, each to whom it concerns.
    pub(crate) fn lane_reports(&mut self, now: u64) {
        let _ = now;
        for lane in 0..self.supervisor.lanes.len() {
            while let Ok(report) = self.supervisor.lanes[lane].reports.pop() {
                match report {
                    Report::Saved(saved) => self.retain_answer(lane, saved),
                    Report::Exchanged(told) => self.exchanged(*told, now),
                    Report::SwapEnded(exchange) => self.swap_ended(*exchange, now),
                    Report::Tap(tap) => drop(tap),
                }
            }
        }
    }

    fn wish(&mut self, pending: Pending, now: u64) {
        if let Some(why) = pending.forbidden.clone() {
            let mut draft = pending.refusal(now, &why);
            draft.priority = FORBIDDEN;
            self.tell(draft, Vec::new());
            return pending.answer(Err(Refused::new("forbidden", why)));
        }
        if let Some(wish) = AlarmWish::new(&pending.operation) {
            return self.router.insert(now, Wish::Alarms(Box::new((pending, wish))));
        }
        let operator = pending.operator.clone();
        let result = match &pending.operation {
            Operation::Read { tags } => self.read_tags(tags).map(Answer::Tags),
            Operation::Alarms { all } => Ok(Answer::Alarms(self.alarm_rows(*all))),
            Operation::Forces => Ok(Answer::Forces(self.forced())),
            Operation::Status => Ok(Answer::Status(self.status(now))),
            Operation::Heartbeat => Ok(done(self.hear(now))),
            Operation::Recording => self.recording_asked().map(Answer::Recording),
            Operation::ReadValues { block } => self.read_values(block).map(Answer::Tags),
            Operation::Set { values, write } => match self.stage(values, *write, &operator, now) {
                Ok(staged) if *write && !staged.settings.is_empty() => {
                    return self.write_settings(staged.settings, staged.done, pending, now);
                }
                staged => staged.map(|s| done(s.done)),
            },
            Operation::WriteValues { block } => match self.staged(block) {
                Ok(staged) => return self.write_settings(staged, Vec::new(), pending, now),
                Err(refused) => Err(refused),
            },
            Operation::DiscardValues { block } => self.discard(block, &operator, now).map(done),
            Operation::Force { tag, value } => self.force(tag, value, &operator, now).map(done),
            Operation::Unforce { tag } => self.unforce(tag, &operator, now).map(done),
            Operation::Command { tag, on } => self.command(tag, *on, &operator, now).map(done),
            Operation::Swap(order) => self.swap(order, &operator, now),
            Operation::CancelSwap { number } => self.cancel_swap(*number, &operator, now),
            Operation::Swaps { number } => self.swap_list(*number),
            Operation::Rollback { block, to } => self.rollback(block, to, &operator, now),
            // Those of alarms went another way.
            _ => Err(Refused::new("unknown", "this plant does not know the operation")),
        };
        if let (Err(refused), false) = (&result, pending.operation.only_looks()) {
            let draft = pending.refusal(now, &refused.message);
            self.tell(draft, Vec::new());
        }
        pending.answer(result);
    }

    /// Refuses a wish, on record.
    pub(super) fn refuse(&mut self, pending: Pending, why: Refused, now: u64) {
        self.tell(pending.refusal(now, &why.message), Vec::new());
        pending.answer(Err(why));
    }

    /// A record in its turn.
    pub(crate) fn tell(&mut self, draft: Draft, kept: Vec<Kept>) {
        self.router.insert(draft.time, Wish::Record(Box::new(draft), kept));
    }

    /// The draft of a record about what an operator did.
    pub(crate) fn did(now: u64, kind: Kind, source: &str, transition: &'static str, operator: &Operator) -> Draft {
        let mut draft = Draft::new(now, kind, source, transition);
        draft.user.clone_from(&operator.user);
        draft.priority = PRIORITY;
        remark(&mut draft, operator);
        draft
    }
}

impl Pending {
    /// The record of a wish that does not come true, at plant time `now`, ns.
    pub(crate) fn refusal(&self, now: u64, why: &str) -> Draft {
        let (kind, source) = self.operation.about();
        let mut draft = Draft::new(now, kind, source, "refused");
        draft.user.clone_from(&self.operator.user);
        draft.priority = PRIORITY;
        draft.text = format!("{}: {why}", self.operation.name());
        remark(&mut draft, &self.operator);
        draft
    }
}

pub(super) fn done(done: Vec<String>) -> Answer {
    Answer::Done { done }
}

impl Operation {
    /// Nothing is changed by it.
    pub fn only_looks(&self) -> bool {
        matches!(
            self,
            Self::Read { .. }
                | Self::ReadValues { .. }
                | Self::Forces
                | Self::Alarms { .. }
                | Self::Status
                | Self::Recording
                | Self::Swaps { .. }
        )
    }

    /// Its name in records.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Read { .. } => "read",
            Self::Set { .. } => "set",
            Self::WriteValues { .. } => "write-values",
            Self::DiscardValues { .. } => "discard-values",
            Self::ReadValues { .. } => "read-values",
            Self::Force { .. } => "force",
            Self::Unforce { .. } => "unforce",
            Self::Forces => "forces",
            Self::Command { .. } => "command",
            Self::Alarms { .. } => "alarms",
            Self::Acknowledge { .. } => "acknowledge",
            Self::Reset { .. } => "reset",
            Self::Shelve { .. } => "shelve",
            Self::Unshelve { .. } => "unshelve",
            Self::OutOfService { out: true, .. } => "out-of-service",
            Self::OutOfService { out: false, .. } => "in-service",
            Self::Heartbeat => "heartbeat",
            Self::Status => "status",
            Self::Recording => "recording",
            Self::Swap(_) => "swap",
            Self::CancelSwap { .. } => "cancel-swap",
            Self::Swaps { .. } => "swaps",
            Self::Rollback { .. } => "rollback",
        }
    }

    /// What it is about: kind and source of its record when it is refused.
    fn about(&self) -> (Kind, String) {
        match self {
            Self::Set { values, .. } => (Kind::Setting, values.first().map_or("", |(tag, _)| tag).to_owned()),
            Self::WriteValues { block } | Self::DiscardValues { block } => (Kind::Setting, block.clone()),
            Self::Force { tag, .. } | Self::Unforce { tag } => (Kind::Audit, tag.clone()),
            Self::Command { tag, .. } => (Kind::Command, tag.clone()),
            Self::Acknowledge { alarm, .. }
            | Self::Reset { alarm }
            | Self::Shelve { alarm, .. }
            | Self::Unshelve { alarm }
            | Self::OutOfService { alarm, .. } => (Kind::Command, alarm.clone()),
            Self::Swap(order) => (Kind::Swap, order.parts.first().map_or("plant", |p| &p.block).to_owned()),
            Self::Rollback { block, .. } => (Kind::Swap, block.clone()),
            Self::CancelSwap { .. } => (Kind::Swap, "plant".into()),
            _ => (Kind::Audit, "plant".into()),
        }
    }
}
