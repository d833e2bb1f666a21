//! Runs cases at virtual time.

use crate::model::{Case, Changes, Input, PlantTest, Step};
use crate::subject;
use crate::verdict::Wishes;
use crate::world::{Left, World};
use latchwork_block::Port;
use latchwork_image::Type;
use latchwork_record::Record;
use latchwork_testbed::case::kit::{Column, History, Kind};
use latchwork_testbed::case::{CaseReport, FAILURES, Failure, Mismatch, Timeline};
use std::collections::BTreeMap;

impl PlantTest {
    /// Runs one case.
    pub fn run(&self, case: &Case) -> CaseReport {
        let report = CaseReport {
            name: case.name.clone(),
            line: case.line,
            passed: true,
            steps: 0,
            executions: 0,
            time_ns: 0,
            failures: Vec::new(),
            more_failures: 0,
        };
        let mut run = Run {
            test: self,
            case,
            points: BTreeMap::new(),
            cells: Vec::new(),
            history: History::default(),
            wishes: Wishes::default(),
            records: Vec::new(),
            report,
        };
        run.case();
        run.close();
        run.report.passed = run.report.failures.is_empty();
        run.report
    }
}

/// A case under way.
pub(crate) struct Run<'a> {
    test: &'a PlantTest,
    case: &'a Case,
    /// Input points as they were set last: the world outside goes on when the plant is restarted.
    points: BTreeMap<String, Input>,
    /// Of the watched tags, two cells each.
    pub(crate) cells: Vec<u64>,
    history: History,
    pub(crate) wishes: Wishes,
    /// Since the step before.
    pub(crate) records: Vec<Record>,
    report: CaseReport,
}

impl<'a> Run<'a> {
    fn case(&mut self) {
        let case = self.case;
        let Some(mut world) = self.start(0, Left::default()) else { return };
        self.points(&mut world, &case.inputs, 0);
        for (number, step) in case.steps.iter().enumerate() {
            self.before(&mut world, step.at);
            if step.restart {
                self.answers(&mut world, step.at, true);
                self.report.executions += world.scans();
                let (left, records) = world.stop();
                self.records.extend(records);
                self.history.clear();
                let Some(next) = self.start(step.at, left) else { return };
                world = next;
            }
            self.change(&mut world, &step.changes, step.at, number);
            world.advance(step.at);
            self.seen(&mut world, step.at);
            self.judge(&mut world, step);
            self.answers(&mut world, step.at, false);
            self.report.time_ns = step.at;
            self.report.steps += 1;
        }
        let end = case.steps.last().map_or(0, |s| s.at);
        self.answers(&mut world, end, true);
        self.report.executions += world.scans();
    }

    /// Starts the plant with the input points as they are.
    fn start(&mut self, at: u64, left: Left) -> Option<World> {
        match subject::start_with(&self.test.model, &self.case.settings, &self.test.engine) {
            Ok(plant) => {
                let mut world = World::start(plant, at, left);
                self.points.values().for_each(|input| world.set(input, at));
                Some(world)
            }
            Err(why) => {
                // With the settings of the plant file it did, when the test was checked.
                let mismatch = Mismatch { what: "plant".into(), expected: "a start".into(), got: why };
                self.fail("start", self.case.line, at, vec![mismatch]);
                None
            }
        }
    }

    /// Everything that is due before a time.
    fn before(&mut self, world: &mut World, at: u64) {
        while let Some(next) = world.next().filter(|next| *next < at) {
            world.advance(next);
            self.seen(world, next);
            self.answers(world, next, false);
        }
    }

    /// What has happened at a time goes into the timeline and the records.
    fn seen(&mut self, world: &mut World, at: u64) {
        self.records.extend(world.told());
        world.look(self.case.watched.iter().map(|(name, _)| name.as_str()), &mut self.cells);
        self.history.note(at, &self.cells);
    }

    /// Changes points.
    fn points(&mut self, world: &mut World, inputs: &[Input], at: u64) {
        for input in inputs {
            world.set(input, at);
            let known = self.points.entry(input.tag.clone()).or_insert_with(|| input.clone());
            (known.cell, known.quality) = (input.cell.or(known.cell), input.quality);
        }
    }

    /// Changes points and brings wishes.
    fn change(&mut self, world: &mut World, changes: &Changes, at: u64, step: usize) {
        self.points(world, &changes.inputs, at);
        self.wishes.open(step, self.case.steps[step].expect.refused.as_deref());
        for operation in &changes.wishes {
            let told = world.wish(operation.clone(), at);
            self.wishes.add(step, operation.name(), told);
        }
    }

    /// What the plant has answered by now; with `last`, what it has not is wrong, too.
    fn answers(&mut self, world: &mut World, at: u64, last: bool) {
        for (step, mismatch) in self.wishes.heard(world, last) {
            let step = &self.case.steps[step];
            self.fail(&step.label, step.line, at, vec![mismatch]);
        }
    }

    fn judge(&mut self, world: &mut World, step: &Step) {
        let mismatches = crate::verdict::judge(self, world, step);
        self.records.clear();
        if !mismatches.is_empty() {
            self.fail(&step.label, step.line, step.at, mismatches);
        }
    }

    fn fail(&mut self, step: &str, line: usize, at: u64, mismatches: Vec<Mismatch>) {
        if self.report.failures.len() == FAILURES {
            self.report.more_failures += 1;
            return;
        }
        if !self.cells.is_empty() {
            self.history.failed(at, &self.cells, &mismatches, self.report.failures.len());
        }
        let timeline = Timeline::default();
        self.report.failures.push(Failure { step: step.into(), line, at_ns: at, mismatches, timeline });
    }

    /// What was found has its timelines.
    fn close(&mut self) {
        let ports: Vec<Port> = self.case.watched.iter().map(|(name, ty)| port(name, ty)).collect();
        let columns: Vec<_> = ports.iter().enumerate().map(column).collect();
        for (failure, timeline) in self.history.close(&columns) {
            self.report.failures[failure].timeline = timeline;
        }
    }
}

fn port(name: &str, ty: &Type) -> Port {
    Port { path: name.into(), ty: ty.clone(), signal: true, doc: None }
}

/// A watched tag as a column of a timeline.
fn column((at, port): (usize, &Port)) -> Column<'_> {
    Column { name: port.path.clone(), kind: Kind::Port(port), cell: 2 * at }
}
