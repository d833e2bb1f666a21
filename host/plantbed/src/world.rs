//! A plant under way, from the side of whoever tests it: points, wishes with their answers, what it tells.

use crate::model::Input;
use latchwork_image::{Quality, TagId, View};
use latchwork_plant::assemble::Plant;
use latchwork_plant::lane::Change;
use latchwork_plant::layout::Layout;
use latchwork_plant::operate::{AlarmRow, Answer, Console, Operation, Operator, Refused};
use latchwork_plant::run::{Control, Observer, VirtualRun};
use latchwork_plant::sim::Action;
use latchwork_plant::swap::SwapStatus;
use latchwork_record::{Kept, Record};
use latchwork_retain::{Found, Memory};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::Receiver;

/// What one run leaves to the next.
#[derive(Clone, Default)]
pub(crate) struct Left {
    kept: BTreeMap<String, String>,
    retained: Found,
}

/// What a plant has told.
#[derive(Default)]
struct Log {
    records: Vec<Record>,
    kept: BTreeMap<String, String>,
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

    fn change(&mut self, _: &Change) {}

    fn tick(&mut self, _: u64) -> Control {
        Control::Continue
    }
}

/// An answer that may still be on its way.
pub(crate) type Told = Receiver<Result<Answer, Refused>>;

/// A plant under way. Times are those of the case.
pub(crate) struct World {
    run: VirtualRun,
    console: Console,
    vault: Memory,
    log: Log,
    /// When it was started, ns since the start of the case.
    since: u64,
    left: Left,
    /// The layout that the watched tags were found in, and where they are.
    layout: Option<Arc<Layout>>,
    places: Vec<Option<TagId>>,
    /// Of those that were found.
    view: Option<View>,
}

impl World {
    /// Starts a plant, `since` ns after the start of the case, with what the run before has left.
    pub(crate) fn start(mut plant: Plant, since: u64, left: Left) -> Self {
        plant.set_epoch(since);
        plant.restore(&left.kept);
        let vault = Memory::default();
        plant.retain(&left.retained, Box::new(vault.clone()));
        let console = plant.console();
        let log = Log { records: Vec::new(), kept: left.kept.clone() };
        let run = VirtualRun::begin(plant);
        Self { run, console, vault, log, since, left, layout: None, places: Vec::new(), view: None }
    }

    /// Stops the plant in order; what it leaves, and the records of its end.
    pub(crate) fn stop(mut self) -> (Left, Vec<Record>) {
        self.run.end(&mut self.log);
        let retained = self.vault.all().pop().map_or(self.left.retained, Found::of);
        (Left { kept: self.log.kept, retained }, self.log.records)
    }

    /// When something happens next by itself, ns.
    pub(crate) fn next(&self) -> Option<u64> {
        self.run.next().map(|time| time.saturating_add(self.since))
    }

    /// Everything happens that is due up to a time, ns, and at it.
    pub(crate) fn advance(&mut self, until: u64) {
        self.run.advance(until - self.since, &mut self.log);
    }

    /// Sets an input point.
    pub(crate) fn set(&mut self, input: &Input, at: u64) {
        if let Some((place, _)) = self.run.plant().sim.find(&input.tag) {
            let (cell, quality) = (input.cell, input.quality);
            self.run.stimulate(&Action::Signal { place, cell, quality }, at - self.since);
        }
    }

    /// Brings a wish.
    pub(crate) fn wish(&mut self, operation: Operation, at: u64) -> Result<Told, Refused> {
        let operator = Operator { user: "test".into(), origin: "test".into(), reason: String::new() };
        let told = self.console.bring(operator, operation, None, &Arc::new(AtomicBool::new(false)))?;
        self.run.serve(at - self.since);
        Ok(told)
    }

    /// A question that is answered at once.
    fn ask(&mut self, operation: Operation) -> Option<Answer> {
        let at = self.run.now() + self.since;
        self.wish(operation, at).ok()?.try_recv().ok()?.ok()
    }

    /// All alarms; none, if there is no answer.
    pub(crate) fn alarms(&mut self) -> Option<Vec<AlarmRow>> {
        match self.ask(Operation::Alarms { all: true })? {
            Answer::Alarms(rows) => Some(rows),
            _ => None,
        }
    }

    /// How far a swap is.
    pub(crate) fn swap(&mut self, number: u64) -> Option<SwapStatus> {
        match self.ask(Operation::Swaps { number: Some(number) })? {
            Answer::Swaps(list) => list.into_iter().find(|s| s.number == number),
            _ => None,
        }
    }

    /// Values and qualities of the watched tags, two cells each.
    pub(crate) fn look<'t>(&mut self, tags: impl Iterator<Item = &'t str>, cells: &mut Vec<u64>) {
        let plant = self.run.plant();
        if self.layout.as_ref().is_none_or(|seen| !Arc::ptr_eq(seen, &plant.layout)) {
            self.places = tags.map(|tag| plant.layout.tags.find(tag)).collect();
            self.layout = Some(Arc::clone(&plant.layout));
            self.view = None;
        }
        let places = &self.places;
        let view = self.view.get_or_insert_with(|| plant.view(&places.iter().flatten().copied().collect::<Vec<_>>()));
        view.refresh();
        cells.clear();
        let mut at = 0;
        for place in &self.places {
            if place.is_some() {
                cells.extend([view.cell(at), view.quality(at).cell()]);
                at += 1;
            } else {
                cells.extend([0, Quality::Bad.cell()]);
            }
        }
    }

    /// Whether a watched tag is one of this plant, after [`Self::look`].
    pub(crate) fn has(&self, watched: usize) -> bool {
        self.places.get(watched).is_some_and(Option::is_some)
    }

    /// What was told since this was asked last.
    pub(crate) fn told(&mut self) -> Vec<Record> {
        std::mem::take(&mut self.log.records)
    }

    /// Scans of all lanes.
    pub(crate) fn scans(&self) -> u64 {
        self.run.plant().lanes.iter().map(|l| l.statistics().scans).sum()
    }
}
