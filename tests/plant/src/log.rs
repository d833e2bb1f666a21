//! Observers that keep everything, and one that has operators act on the way.

use crate::Rig;
use latchwork_plant::assemble::Time;
use latchwork_plant::lane::Change;
use latchwork_plant::operate::{Answer, Console, Operation, Operator, Refused};
use latchwork_plant::run::{Control, Observer, RunOptions, run_virtual};
use latchwork_record::{Kept, Record};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::Receiver;

/// What an operator is told.
pub type Told = Result<Answer, Refused>;

/// All that a run has told.
#[derive(Default)]
pub struct Log {
    /// Records.
    pub records: Vec<Record>,
    /// What is to be kept, as the journal would have it.
    pub kept: BTreeMap<String, String>,
    /// Values that were traced.
    pub changes: Vec<Change>,
}

impl Observer for Log {
    fn record(&mut self, record: &Record, kept: &[Kept]) {
        for Kept { name, value } in kept.iter().cloned() {
            match value {
                Some(value) => drop(self.kept.insert(name, value)),
                None => drop(self.kept.remove(&name)),
            }
        }
        self.records.push(record.clone());
    }

    fn change(&mut self, change: &Change) {
        self.changes.push(*change);
    }

    fn tick(&mut self, _: u64) -> Control {
        Control::Continue
    }
}

/// Brings wishes at their times, and hears what comes of them.
struct Script {
    console: Console,
    wishes: VecDeque<(u64, Operation)>,
    asked: Vec<Receiver<Told>>,
    log: Log,
}

impl Observer for Script {
    fn record(&mut self, record: &Record, kept: &[Kept]) {
        self.log.record(record, kept);
    }

    fn change(&mut self, change: &Change) {
        self.log.change(change);
    }

    fn tick(&mut self, now: u64) -> Control {
        while self.wishes.front().is_some_and(|(time, _)| *time <= now) {
            let Some((_, operation)) = self.wishes.pop_front() else { break };
            let operator = Operator { user: "anna".into(), origin: "cli".into(), reason: "a test".into() };
            let told = self.console.bring(operator, operation, None, &Arc::new(AtomicBool::new(false)));
            self.asked.push(told.expect("a plant that hears"));
        }
        Control::Continue
    }
}

impl Rig {
    /// Runs it at virtual time for `duration`, ns, with wishes of the operator anna at their times, ns, in this order; what
    /// each is told, and all that the run has.
    ///
    /// # Panics
    /// If a wish is not answered.
    pub fn operated(&self, duration: u64, wishes: Vec<(u64, Operation)>) -> (Vec<Told>, Log) {
        let mut plant = self.plant(Time::Virtual);
        let mut script =
            Script { console: plant.console(), wishes: wishes.into(), asked: Vec::new(), log: Log::default() };
        let options = RunOptions { duration: Some(duration), ..RunOptions::default() };
        run_virtual(plant, &options, &AtomicBool::new(false), &mut script);
        let answers = script.asked.iter().map(|told| told.try_recv().expect("every wish is answered")).collect();
        (answers, script.log)
    }
}
