//! Runs cases at virtual time.

use super::history::{History, columns};
use super::model::{Case, Expect, Step, Subject, Takeover, TestFile};
use super::report::{CaseReport, Failure, Mismatch, Timeline};
use super::verdict::{Trouble, told};
use latchwork_block::{Fault, Instance, Limits, Scan};

/// Failures of a case that are told in full.
pub const FAILURES: usize = 4;

impl TestFile {
    /// Runs one case. The engine must be ticked once in `tick` ns meanwhile, or a block that never ends is never stopped.
    pub fn run(&self, case: &Case, tick: u64) -> CaseReport {
        let mut run = Run {
            case,
            limits: self.limits(tick),
            subject: &self.subject,
            instance: None,
            cells: Vec::new(),
            ins: Vec::new(),
            settings: Vec::new(),
            last: None,
            first: true,
            elapsed: case.elapsed,
            history: History::default(),
            report: CaseReport {
                name: case.name.clone(),
                line: case.line,
                passed: true,
                steps: 0,
                executions: 0,
                time_ns: 0,
                failures: Vec::new(),
                more_failures: 0,
            },
        };
        run.case();
        run.close();
        run.complete();
        run.report.passed = run.report.failures.is_empty();
        run.report
    }
}

/// A case under way.
pub(super) struct Run<'a> {
    pub(super) case: &'a Case,
    pub(super) limits: Limits,
    pub(super) subject: &'a Subject,
    /// `None` after a fault.
    pub(super) instance: Option<Instance>,
    /// Arguments, then results.
    pub(super) cells: Vec<u64>,
    pub(super) ins: Vec<u32>,
    pub(super) settings: Vec<u64>,
    /// Time of the last execution since the start.
    pub(super) last: Option<u64>,
    /// The next execution is the first after a cold start.
    pub(super) first: bool,
    /// What the next execution is told when there was none before it.
    pub(super) elapsed: u64,
    pub(super) history: History,
    pub(super) report: CaseReport,
}

impl<'a> Run<'a> {
    fn case(&mut self) {
        self.lay_out();
        if !self.start() {
            return;
        }
        let case = self.case;
        for step in &case.steps {
            if !self.executions_before(step) || !self.step(step) {
                return;
            }
            self.report.steps += 1;
        }
    }

    /// A case of which a part was not done has not passed, whatever the reason.
    fn complete(&mut self) {
        let (done, steps) = (self.report.steps, self.case.steps.len());
        if done == steps || !self.report.failures.is_empty() {
            return;
        }
        let (expected, got) = (format!("all {steps}"), format!("{done}: the block has ended before"));
        let mismatches = vec![Mismatch { what: "steps".into(), expected, got }];
        let Step { label, line, at, .. } = &self.case.steps[done];
        let (step, line, at_ns) = (label.clone(), *line, *at);
        self.report.failures.push(Failure { step, line, at_ns, mismatches, timeline: Timeline::default() });
    }

    /// Cells for the class that runs.
    pub(super) fn lay_out(&mut self) {
        let class = &self.subject.class;
        self.ins = (0..class.argument_cells() as u32).collect();
        self.cells = vec![0; class.argument_cells() + class.output_cells()];
    }

    /// The first instance, configured, with the case's state and inputs; true when the case may go on.
    fn start(&mut self) -> bool {
        let case = self.case;
        let started = self.instance(&case.settings, case.state.as_deref());
        for input in &case.inputs {
            self.cells[input.cell] = input.value;
        }
        self.first = case.first.unwrap_or(case.state.is_none());
        let mut mismatches = Vec::new();
        self.judge(&mut mismatches, &started, case.refused.as_deref(), case.fault.as_deref());
        let sound = mismatches.is_empty();
        if !sound {
            // Nothing was executed that a timeline could show.
            let timeline = Timeline::default();
            let (step, line) = ("start".into(), case.line);
            self.report.failures.push(Failure { step, line, at_ns: 0, mismatches, timeline });
        }
        sound && started.is_ok()
    }

    /// Makes an instance of the present version. Fields of `state` without a value are what the block starts with.
    pub(super) fn instance(&mut self, settings: &[Option<u64>], state: Option<&[Option<u64>]>) -> Result<(), Trouble> {
        let mut instance = self.subject.template.instantiate(&self.limits)?;
        let defaults = instance.defaults()?;
        let value = |(i, given): (usize, &Option<u64>)| given.or_else(|| defaults.as_ref().map(|d| d[i])).unwrap_or(0);
        self.settings = settings.iter().enumerate().map(value).collect();
        instance.configure(&self.settings)?.map_err(Trouble::Refused)?;
        if let Some(state) = state {
            let own = instance.save()?.unwrap_or_default();
            let cells: Vec<u64> = own.iter().zip(state).map(|(own, given)| given.unwrap_or(*own)).collect();
            instance.restore(&cells)?;
        }
        self.instance = Some(instance);
        Ok(())
    }

    /// Executions between the last one and a step; false when one of them ended the case.
    fn executions_before(&mut self, step: &Step) -> bool {
        let every = self.case.every;
        while every > 0 && self.instance.is_some() {
            let next = self.last.map_or(0, |last| last.saturating_add(every));
            if next >= step.at {
                break;
            }
            if let Err(fault) = self.execute(next, 0) {
                let expected = "none before the step".into();
                let mismatch = Mismatch { what: "fault".into(), expected, got: told(&fault) };
                let label = format!("before {}", step.label);
                self.fail(&label, step.line, next, vec![mismatch]);
                return false;
            }
        }
        true
    }

    fn execute(&mut self, at: u64, commands: u64) -> Result<(), Fault> {
        let Some(instance) = &mut self.instance else { return Ok(()) };
        let arguments = self.ins.len();
        if !self.subject.class.commands.is_empty() {
            self.cells[arguments - 1] = commands;
        }
        let elapsed = self.last.map_or(self.elapsed, |last| at - last);
        let scan = Scan { now: self.case.start.saturating_add(at), elapsed, first: self.first };
        self.report.executions += 1;
        self.report.time_ns = at;
        self.last = Some(at);
        let done = instance.execute(scan, &self.ins, arguments as u32, &mut self.cells);
        // Whoever watches it would be told no messages; they must not pile up.
        instance.drain_log(|_, _| {});
        match done {
            Ok(()) => {
                self.first = false;
                self.history.note(at, &self.cells);
            }
            Err(_) => self.instance = None,
        }
        done
    }

    /// One step; false when the case cannot go on.
    fn step(&mut self, step: &'a Step) -> bool {
        let mut mismatches = Vec::new();
        let changed = self.change(step);
        let faulted = matches!(changed, Err(Trouble::Fault(_)));
        if faulted {
            self.instance = None;
        }
        let swap = matches!(step.takeover, Takeover::Swap { .. });
        if swap && changed.is_ok() == step.expect.refused.is_some() {
            // It went another way than expected: all that follows is about the ports of another version than runs.
            self.judge(&mut mismatches, &changed, step.expect.refused.as_deref(), None);
            self.fail(&step.label, step.line, step.at, mismatches);
            return false;
        }
        for input in &step.inputs {
            self.cells[input.cell] = input.value;
        }
        let Expect { refused, fault, .. } = &step.expect;
        if faulted {
            self.judge(&mut mismatches, &changed, refused.as_deref(), fault.as_deref());
        } else {
            // What follows a refusal is an execution like any other, with faults of its own.
            let executed = self.execute(step.at, step.commands).map_err(Trouble::Fault);
            self.judge(&mut mismatches, &changed, refused.as_deref(), None);
            self.judge(&mut mismatches, &executed, None, fault.as_deref());
        }
        if self.instance.is_some() {
            self.compare(step, &mut mismatches);
        } else if mismatches.is_empty() && step.expect.looks() {
            let (expected, got) = ("an execution".into(), "none: the block has ended in a fault".into());
            mismatches.push(Mismatch { what: "execution".into(), expected, got });
        }
        let sound = mismatches.is_empty();
        if !sound {
            self.fail(&step.label, step.line, step.at, mismatches);
        }
        // After a fault as expected the next step brings another instance.
        self.instance.is_some() || sound
    }

    fn fail(&mut self, step: &str, line: usize, at: u64, mismatches: Vec<Mismatch>) {
        if self.report.failures.len() == FAILURES {
            self.report.more_failures += 1;
            return;
        }
        self.history.failed(at, &self.cells, &mismatches, self.report.failures.len());
        let timeline = Timeline::default();
        self.report.failures.push(Failure { step: step.into(), line, at_ns: at, mismatches, timeline });
    }

    /// What was found so far has all of its timelines.
    pub(super) fn close(&mut self) {
        for (failure, timeline) in self.history.close(&columns(&self.subject.class)) {
            self.report.failures[failure].timeline = timeline;
        }
    }
}
