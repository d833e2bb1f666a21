//! A closer look at what went wrong: whether it does so again, and the smallest sequence that shows it.

use super::{Search, trial};
use crate::check::shown;
use crate::fuzz::difference::{classify, differs, grows, last_execution};
use crate::fuzz::report::{Finding, Kind};
use crate::fuzz::sequence::{Sequence, Shrunk};
use crate::fuzz::shrink::shrink;
use crate::fuzz::trial::{Failure, Trial, Twin};
use crate::fuzz::write;
use latchwork_block::FaultKind;
use latchwork_image::format_duration;

/// Looks that shrinking may take when each waits until the block is stopped.
const LATE_TRIES: u32 = 150;
/// The same where each is a run of thousands of executions.
const GROWTH_TRIES: u32 = 100;

impl Search<'_> {
    /// An execution took long: what is as long each time is the block's doing, all else the machine's.
    pub(super) fn slow(&mut self, sequence: &Sequence, first: u64) {
        let mut probe = trial(self.subjects, self.options, self.clock);
        let again = (0..2).map(|_| last_execution(&mut probe, sequence)).min().flatten();
        let Some(sure) = again.map(|ns| ns.min(first)) else { return };
        self.worst = self.worst.max(sure);
        let budget = self.options.budget;
        if sure <= budget || self.known(Kind::Budget) {
            return;
        }
        let look = self.shares.look();
        let mut fails = |s: &Sequence| (0..2).all(|_| last_execution(&mut probe, s).is_none_or(|ns| ns > budget));
        let small = shrink(sequence.clone(), self.class(), &self.defaults, tries(sequence), look, &mut fails);
        let ns = last_execution(&mut probe, &small.sequence).unwrap_or(sure);
        self.shares.looked(look);
        let message =
            format!("an execution takes {}, longer than its budget of {}", shown(ns), format_duration(budget));
        self.add(Kind::Budget, message, sequence.executions(), &small, Some(&probe));
    }

    /// A sequence went wrong: what kind it is, and the smallest sequence of that kind.
    pub(super) fn found(&mut self, sequence: &Sequence, failure: Failure) {
        let mut probe = trial(self.subjects, self.options, self.clock);
        let (kind, told) = classify(&mut probe, sequence, &failure);
        if self.known(kind) {
            return;
        }
        let cut = match failure.place {
            Some((step, execution)) => sequence.until(step, execution),
            None => Sequence { steps: vec![sequence.steps[0].clone()], ..sequence.clone() }.until(0, 0),
        };
        let raw = failure.kind;
        let mut fails = |s: &Sequence| matches!(probe.run(s, told), Err(f) if f.kind == raw);
        if !fails(&cut) {
            // A budget that was missed once is the machine's doing. Everything else is certain, but not to be had again.
            if kind != Kind::Budget {
                let cut = Shrunk { sequence: cut, smallest: true };
                self.add(kind, failure.message, sequence.executions(), &cut, None);
            }
            return;
        }
        let look = self.shares.look();
        let tries = if kind == Kind::Budget { LATE_TRIES } else { tries(&cut) };
        let small = shrink(cut, self.class(), &self.defaults, tries, look, &mut fails);
        let last = probe.run(&small.sequence, told);
        self.shares.looked(look);
        let message = match last {
            Err(last) => {
                let budget = format_duration(self.options.budget);
                let message = match kind {
                    Kind::Budget => format!("an execution was stopped, long after its budget of {budget}"),
                    _ if last.message.is_empty() => differs(&probe, &last, kind),
                    _ => last.message.clone(),
                };
                let (defaults, executions) = (&self.defaults, sequence.executions());
                let case = write::case(&probe, defaults, &small, kind, Some(&last), &message);
                self.push(kind, message, executions, &small, case);
                return;
            }
            Ok(_) => failure.message,
        };
        self.add(kind, message, sequence.executions(), &small, Some(&probe));
    }

    /// Grows still when it runs eight times as long: a heap that is filled once before it is swept does not.
    pub(super) fn growth(&mut self, body: &Sequence, power: u32) {
        let mut probe = trial(self.subjects, self.options, self.clock);
        let mut grew = |s: &Sequence, power: u32, periods: u32| match probe.run(&s.looped(1 << power), Twin::default())
        {
            Ok(ran) => ran && grows(&probe.memory, power, periods),
            Err(failure) => failure.kind == Kind::Fault(FaultKind::Memory),
        };
        if !grew(body, power + 3, 5) {
            return;
        }
        let look = self.shares.look();
        let mut fails = |s: &Sequence| grew(s, power, 2);
        let small = shrink(body.clone(), self.class(), &self.defaults, GROWTH_TRIES, look, &mut fails);
        let _ = grew(&small.sequence, power, 2);
        self.shares.looked(look);
        let at = |power: u32| probe.memory.get(power as usize).copied().unwrap_or(self.options.memory);
        let bytes = at(power).saturating_sub(at(power - 1)) as f64 / (1u64 << (power - 1)) as f64;
        let message = format!("its memory grows by some {bytes:.0} bytes in every execution and never ends growing");
        let case = write::growth(&probe, &self.defaults, &small, 1 << (power - 1), &message);
        self.growth_limit = case.as_ref().map(|(_, limit)| *limit);
        self.push(Kind::Growth, message, body.executions(), &small, case.map(|(case, _)| case));
    }

    pub(super) fn add(&mut self, kind: Kind, message: String, found: u64, small: &Shrunk, probe: Option<&Trial<'_>>) {
        let case = probe.and_then(|p| write::case(p, &self.defaults, small, kind, None, &message));
        self.push(kind, message, found, small, case);
    }

    fn push(&mut self, kind: Kind, message: String, executions_found: u64, small: &Shrunk, case: Option<String>) {
        let (sequence, executions) = (self.sequences, small.sequence.executions());
        let smallest = small.smallest;
        self.findings.push(Finding { kind, message, sequence, executions_found, executions, smallest, case });
    }
}

/// Looks that shrinking may take: fewer where each takes long.
fn tries(sequence: &Sequence) -> u32 {
    (8_000_000 / sequence.executions().max(1)).clamp(80, 2000) as u32
}
