//! Probation: the old version waits while the new one shows what it can, and is back at once when it fails.

use super::exchange::{End, Exchange};
use super::{BlockState, Lane, Report, RestartRequest};
use latchwork_block::{Fault, Instance};
use latchwork_record::{Entry, Kind, Text};
use std::sync::atomic::Ordering;

/// Priority of the record of a fault that ends a probation.
const PRIORITY: u8 = 200;

impl Lane {
    /// Which blocks are timed: those that wait for their exchange and those on probation.
    pub(super) fn list_timed(&mut self) {
        self.timed.clear();
        self.timed.extend(self.trials.iter().flat_map(|e| e.parts.iter().map(|p| p.block)));
        self.timed.sort_unstable();
    }

    /// Executes a block of a lane in which some are timed.
    #[cold]
    pub(super) fn execute_timed(&mut self, index: usize, now: u64, clock: &dyn Fn() -> u64) {
        if self.timed.binary_search(&(index as u32)).is_err() {
            return self.execute(index, now);
        }
        let trial = self.trial_of(index).map(|at| (self.trials[at].number, self.trials[at].baseline(index)));
        let worked = self.work.map(|work| work());
        let begun = clock();
        self.execute(index, now);
        let spent = clock().saturating_sub(begun);
        // Where the machine did something else meanwhile, no version is to blame.
        let worked = self.work.zip(worked).map(|(work, before)| work().saturating_sub(before));
        let spent = worked.map_or(spent, |worked| spent.min(worked));
        if let Some((_, baseline)) = trial.filter(|(number, _)| self.trials.iter().all(|e| e.number != *number)) {
            // It has failed and is gone.
            self.excess = self.excess.saturating_add(spent.saturating_sub(baseline));
        }
        let executed = self.parts.blocks[index].instance.is_some();
        let parts = self.trials.iter_mut().flat_map(|e| {
            let probation = e.on_probation();
            e.parts.iter_mut().map(move |p| (probation, p))
        });
        for (probation, part) in parts.filter(|(_, p)| p.block as usize == index && executed) {
            if probation {
                part.spent += spent;
                part.left = part.left.saturating_sub(1);
            } else {
                part.baseline = part.baseline.max(spent);
            }
        }
    }

    /// At the end of a scan that took so long: ends probations that are over, and those of versions that made the scan too
    /// long. True when the watchdog has nothing to bark at any more.
    #[cold]
    pub(super) fn judge(&mut self, now: u64, scan_time: u64) -> bool {
        let watchdog = self.parts.watchdog;
        let limit = if self.parts.every > 0 { self.parts.every.min(watchdog) } else { watchdog };
        // Several at once must not hide behind each other: the one with the largest excess goes first.
        let excess = |e: &Exchange| if e.on_probation() { e.excess() } else { 0 };
        let total = self.trials.iter().map(|e| excess(e)).fold(0, u64::saturating_add);
        let largest = self.trials.iter().max_by_key(|e| excess(e)).filter(|e| e.on_probation());
        let largest = largest.filter(|_| scan_time > limit && scan_time.saturating_sub(total) <= limit);
        let largest = largest.map(|e| (e.number, scan_time.saturating_sub(e.excess()) > limit));
        let (mut excused, mut at) = (false, 0);
        while at < self.trials.len() {
            let trial = &mut *self.trials[at];
            if !trial.on_probation() {
                trial.measure = trial.measure.saturating_sub(1);
                at += 1;
                continue;
            }
            let worst = trial.parts.iter().max_by_key(|p| p.spent.saturating_sub(p.baseline));
            let worst = worst.map(|p| (p.block, p.spent, p.baseline));
            let left = trial.parts.iter().map(|p| p.left).max().unwrap_or(0);
            trial.left.store(left, Ordering::Relaxed);
            trial.parts.iter_mut().for_each(|p| p.spent = 0);
            if largest.is_some_and(|(number, _)| number == trial.number)
                && let Some((block, spent, baseline)) = worst
            {
                let than = if baseline == 0 { Text::default() } else { us(baseline) };
                let why = Text::format(format_args!(
                    "the scan took {} us, {} us are allowed; the new version took {} us of them{}",
                    scan_time / 1000,
                    limit / 1000,
                    spent / 1000,
                    than.as_str()
                ));
                excused |= scan_time.saturating_sub(total) <= watchdog;
                self.blame(block, now, "overrun", why.as_str());
                self.roll_back(at, now, End::RolledBack(why));
            } else if left == 0 && !largest.is_some_and(|(_, others)| others) {
                self.end_trial(at, now, End::Kept);
            } else {
                at += 1;
            }
        }
        excused
    }

    /// A fault of a block on probation: the old one is back, in order to execute in this very scan. False for any other.
    pub(super) fn fault_on_trial(&mut self, index: usize, now: u64, fault: &Fault) -> bool {
        let Some(at) = self.trial_of(index) else { return false };
        if self.parts.blocks[index].instance.as_ref().is_some_and(Instance::has_log) {
            self.take_messages(index, now);
        }
        self.statistics.faults += 1;
        self.parts.blocks[index].rest.faults += 1;
        self.blame(index as u32, now, fault.kind.name(), &fault.message);
        self.roll_back(at, now, End::RolledBack(Text::new(&fault.message)));
        true
    }

    /// The probation that a block is on.
    fn trial_of(&self, index: usize) -> Option<usize> {
        let of = |e: &Exchange| e.on_probation() && e.parts.iter().any(|p| p.block as usize == index);
        self.trials.iter().position(|e| of(e))
    }

    fn blame(&mut self, block: u32, now: u64, transition: &'static str, why: &str) {
        let source = self.parts.blocks[block as usize].rest.source;
        let entry = Entry::new(now, Kind::Fault, source, transition).priority(PRIORITY);
        self.parts.recorder.push(entry.text(format_args!("on probation; the version before is back: {why}")));
    }

    /// All old versions of an exchange are back, each as it stood.
    fn roll_back(&mut self, at: usize, now: u64, end: End) {
        let mut trial = self.trials.swap_remove(at);
        self.excess = self.excess.saturating_add(trial.excess());
        self.back.clear();
        self.back.extend(trial.parts.iter().map(|p| p.block));
        self.back.sort_unstable();
        let returned = end == End::Returned;
        for part in &mut trial.parts {
            self.switch(part);
            if let Some(tap) = &mut part.tap {
                tap.end(&mut self.parts.tape);
            }
            if returned && part.failed.is_some() {
                part.bury(now);
            }
            let index = part.block as usize;
            let parts = &mut self.parts;
            let block = &mut parts.blocks[index];
            if block.instance.is_some() {
                continue;
            }
            // It was out of order before the exchange, and is so again.
            super::fault::put_out(block, &mut parts.cells);
            if block.rest.state == BlockState::Faulted && block.rest.ready.is_none() {
                let (model, version) = (block.rest.model, block.rest.version);
                let _ = parts.restarts.push(RestartRequest { block: part.block, model, version, dead: None });
            }
            self.status_changed(index, now);
        }
        (trial.end, trial.ended) = (end, now);
        self.list_timed();
        self.send(Report::SwapEnded(trial));
    }

    /// The old versions wait no longer.
    fn end_trial(&mut self, at: usize, now: u64, end: End) {
        let mut trial = self.trials.swap_remove(at);
        (trial.end, trial.ended) = (end, now);
        self.list_timed();
        self.send(Report::SwapEnded(trial));
    }

    /// An operator wants the old versions back; nothing happens when the probation is over.
    #[cold]
    pub(super) fn take_back(&mut self, number: u64, now: u64, clock: &dyn Fn() -> u64) {
        let Some(at) = self.trials.iter().position(|e| e.number == number && e.on_probation()) else { return };
        let begun = clock();
        for n in 0..self.trials[at].parts.len() {
            let part = &mut self.trials[at].parts[n];
            let index = part.block as usize;
            let Some(instance) = &mut self.parts.blocks[index].instance else { continue };
            match instance.save_into(&mut part.state) {
                Ok(there) => part.state_there = there,
                Err(fault) => {
                    self.tell_unsaved(index, now, &fault);
                    self.trials[at].parts[n].failed = Some(fault);
                }
            }
        }
        self.roll_back(at, now, End::Returned);
        self.excess = self.excess.saturating_add(clock().saturating_sub(begun));
    }

    /// The version that goes could not save: it is of no more use, and no other one is to blame.
    #[cold]
    pub(super) fn tell_unsaved(&mut self, index: usize, now: u64, fault: &Fault) {
        self.statistics.faults += 1;
        let rest = &mut self.parts.blocks[index].rest;
        rest.faults += 1;
        let entry = Entry::new(now, Kind::Fault, rest.source, fault.kind.name()).priority(PRIORITY);
        let text = format_args!("the version that goes could not save its state, which is lost: {}", fault.message);
        self.parts.recorder.push(entry.text(text));
    }

    /// New settings reach the old version, too. One that does not take them is no way back any more.
    #[cold]
    pub(super) fn configure_waiting(&mut self, index: usize, cells: &[u64], now: u64) {
        let Some(at) = self.trial_of(index) else { return };
        let part = self.trials[at].parts.iter_mut().find(|p| p.block as usize == index);
        // One that is out of order may wait for its restart.
        let Some(part) = part else { return };
        let Some(instance) = part.other.instance.as_mut().or(part.other.ready.as_mut()) else { return };
        // What was transferred went by name: it has as many as its class.
        if instance.class().settings.len() != cells.len() {
            return;
        }
        let answer = instance.configure(cells);
        if let Some(tap) = &mut part.tap {
            let taken = answer.as_ref().map(Result::is_ok).map_err(|fault| fault.kind);
            tap.settings(cells, taken, &mut self.parts.tape);
        }
        let why = match answer {
            Ok(Ok(())) => return,
            Ok(Err(sentence)) => Text::format(format_args!("the version before refuses the new settings: {sentence}")),
            Err(fault) => {
                Text::format(format_args!("the version before failed at the new settings: {}", fault.message))
            }
        };
        self.end_trial(at, now, End::NoWayBack(why));
    }
}

/// `, the old one at most 12 us`
fn us(baseline: u64) -> Text {
    Text::format(format_args!(", the one before at most {} us", baseline / 1000))
}
