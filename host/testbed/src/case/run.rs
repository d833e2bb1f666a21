//! Runs cases at virtual time.

use super::history::{History, names_of};
use super::model::{Case, Expected, Step, Subject, Takeover, TestFile};
use super::report::{CaseReport, Failure, Mismatch, Timeline};
use latchwork_block::upgrade::Transfer;
use latchwork_block::{Class, Fault, Instance, Limits, Scan};
use latchwork_image::{Quality, Type, format_duration};

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
        run.report.passed = run.report.failures.is_empty();
        run.report
    }
}

/// A case under way.
struct Run<'a> {
    case: &'a Case,
    limits: Limits,
    subject: &'a Subject,
    /// `None` after a fault.
    instance: Option<Instance>,
    /// Arguments, then results.
    cells: Vec<u64>,
    ins: Vec<u32>,
    settings: Vec<u64>,
    /// Time of the last execution since the start.
    last: Option<u64>,
    /// The next execution is the first after a cold start.
    first: bool,
    /// What the next execution is told when there was none before it.
    elapsed: u64,
    history: History,
    report: CaseReport,
}

/// Why a block did not do what it was asked.
enum Trouble {
    Fault(Fault),
    Refused(String),
}

impl From<Fault> for Trouble {
    fn from(fault: Fault) -> Self {
        Self::Fault(fault)
    }
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

    /// Cells for the class that runs.
    fn lay_out(&mut self) {
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
    fn instance(&mut self, settings: &[Option<u64>], state: Option<&[Option<u64>]>) -> Result<(), Trouble> {
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
        let executed = if faulted { Ok(()) } else { self.execute(step.at, step.commands) };
        let outcome = changed.and(executed.map_err(Trouble::Fault));
        self.judge(&mut mismatches, &outcome, step.expect.refused.as_deref(), step.expect.fault.as_deref());
        if self.instance.is_some() {
            self.compare(step, &mut mismatches);
        }
        if !mismatches.is_empty() {
            self.fail(&step.label, step.line, step.at, mismatches);
        }
        self.instance.is_some() || step.expect.fault.is_some()
    }

    /// Everything that happens before the execution.
    fn change(&mut self, step: &'a Step) -> Result<(), Trouble> {
        match &step.takeover {
            Takeover::None => {}
            Takeover::Restart => self.restart()?,
            Takeover::Swap { to, lossy } => {
                // A version that cannot even start takes nothing over: the one before goes on.
                return self.swap(to, *lossy, &step.settings).map_err(|trouble| match trouble {
                    Trouble::Fault(fault) => Trouble::Refused(told(&fault)),
                    refused => refused,
                });
            }
        }
        if step.settings.is_empty() {
            return Ok(());
        }
        let mut settings = self.settings.clone();
        step.settings.iter().for_each(|(i, cell)| settings[*i] = *cell);
        let Some(instance) = &mut self.instance else { return Ok(()) };
        instance.configure(&settings)?.map_err(Trouble::Refused)?;
        self.settings = settings;
        Ok(())
    }

    /// As when a plant stops and starts: what is retained is kept, all else begins anew.
    fn restart(&mut self) -> Result<(), Trouble> {
        let state = match &mut self.instance {
            Some(instance) => instance.save()?,
            None => None,
        };
        let settings: Vec<_> = self.settings.iter().copied().map(Some).collect();
        let state = state.map(|s| s.into_iter().map(Some).collect::<Vec<_>>());
        self.first = state.is_none();
        self.instance(&settings, state.as_deref())?;
        let results = self.ins.len()..;
        self.cells[results].fill(0);
        self.history.clear();
        (self.last, self.elapsed) = (None, 0);
        Ok(())
    }

    /// The next version takes over between two executions.
    fn swap(&mut self, to: &'a Subject, lossy: bool, settings: &[(usize, u64)]) -> Result<(), Trouble> {
        let Some(old) = &mut self.instance else { return Ok(()) };
        let (from, class) = (&self.subject.class, &to.class);
        let saved = old.save()?;
        let mut new = to.template.instantiate(&self.limits)?;
        let mut cells = new.defaults()?.unwrap_or_else(|| vec![0; class.settings.len()]);
        carry(&from.settings, &class.settings, lossy, &self.settings, &mut cells, "setting")?;
        settings.iter().for_each(|(i, cell)| cells[*i] = *cell);
        new.configure(&cells)?.map_err(Trouble::Refused)?;
        let carried = match saved.zip(new.save()?) {
            Some((saved, mut state)) => {
                carry(&from.retained, &class.retained, lossy, &saved, &mut state, "retained field")?;
                new.restore(&state)?;
                true
            }
            None => false,
        };
        let arguments = inputs_of(from, class, &self.cells);
        self.close();
        self.history.clear();
        (self.instance, self.settings, self.first) = (Some(new), cells, !carried);
        self.subject = to;
        self.lay_out();
        self.cells[..arguments.len()].copy_from_slice(&arguments);
        Ok(())
    }

    /// How something went against what was expected of it.
    fn judge(
        &self,
        mismatches: &mut Vec<Mismatch>,
        outcome: &Result<(), Trouble>,
        refused: Option<&str>,
        fault: Option<&str>,
    ) {
        let mut wrong = |what: &str, expected: String, got: String| {
            mismatches.push(Mismatch { what: what.into(), expected, got });
        };
        let part = |refused: &str| format!("a refusal with \"{refused}\"");
        match (outcome, refused, fault) {
            (Ok(()), None, None) => {}
            (Err(Trouble::Refused(sentence)), Some(part), None) if sentence.contains(part) => {}
            (Err(Trouble::Fault(f)), None, Some(kind)) if f.kind.name() == kind => {}
            (Err(Trouble::Refused(sentence)), Some(refused), _) => {
                wrong("refused", part(refused), format!("\"{sentence}\""));
            }
            (Err(Trouble::Refused(sentence)), None, _) => {
                wrong("refused", "no refusal".into(), format!("\"{sentence}\""))
            }
            (Err(Trouble::Fault(f)), _, kind) => {
                wrong("fault", kind.unwrap_or("none").to_owned(), told(f));
            }
            (Ok(()), Some(refused), _) => wrong("refused", part(refused), "none".into()),
            (Ok(()), None, Some(kind)) => wrong("fault", kind.to_owned(), "none".into()),
        }
    }

    /// Outputs, alarms and state against what was expected.
    fn compare(&mut self, step: &Step, mismatches: &mut Vec<Mismatch>) {
        let results = &self.cells[self.ins.len()..];
        step.expect.outputs.iter().for_each(|e| compare(e, results, mismatches));
        if let Some((spoken, on)) = step.expect.alarms {
            let names = &self.subject.class.alarms;
            let got = if names.is_empty() { 0 } else { results.last().copied().unwrap_or(0) };
            if got & spoken != on {
                let named = |word| if word == 0 { "none".into() } else { names_of(names, word) };
                let (expected, got) = (named(on), named(got & spoken));
                mismatches.push(Mismatch { what: "alarms".into(), expected, got });
            }
        }
        if step.expect.state.is_empty() {
            return;
        }
        let Some(instance) = &mut self.instance else { return };
        match instance.save() {
            Ok(state) => {
                let state = state.unwrap_or_default();
                step.expect.state.iter().for_each(|e| compare(e, &state, mismatches));
            }
            Err(fault) => {
                mismatches.push(Mismatch { what: "fault".into(), expected: "none".into(), got: told(&fault) });
                self.instance = None;
            }
        }
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
    fn close(&mut self) {
        for (failure, timeline) in self.history.close(&self.subject.class) {
            self.report.failures[failure].timeline = timeline;
        }
    }
}

/// A fault as it is told.
fn told(fault: &Fault) -> String {
    format!("{} ({})", fault.kind.name(), fault.message)
}

/// Cells that go over by name and type.
fn carry(
    from: &[latchwork_block::Port],
    to: &[latchwork_block::Port],
    lossy: bool,
    old: &[u64],
    new: &mut [u64],
    what: &str,
) -> Result<(), Trouble> {
    let transfer = Transfer::new(from, to, lossy);
    let refused: Vec<_> = transfer.refused().map(|f| format!("`{}`", f.name)).collect();
    if !refused.is_empty() {
        let fields = refused.join(", ");
        return Err(Trouble::Refused(format!(
            "{what} {fields} would lose something in its new type; allow-lossy clamps it"
        )));
    }
    transfer.apply(old, new);
    Ok(())
}

/// Inputs go over where name and type are the same; a signal that was none before is good, any other begins with 0.
fn inputs_of(from: &Class, to: &Class, cells: &[u64]) -> Vec<u64> {
    let mut arguments = vec![0; to.argument_cells()];
    let mut at = 0;
    for port in &to.inputs {
        let mut old = 0;
        for other in &from.inputs {
            if other.path == port.path && other.ty == port.ty {
                arguments[at] = cells[old];
                if port.signal && other.signal {
                    arguments[at + 1] = cells[old + 1];
                }
            }
            old += 1 + usize::from(other.signal);
        }
        at += 1 + usize::from(port.signal);
    }
    arguments
}

fn compare(expected: &Expected, cells: &[u64], mismatches: &mut Vec<Mismatch>) {
    let Expected { name, ty, cell, value, within, quality } = expected;
    if let Some(value) = value
        && !equal(ty, *value, cells[*cell], *within)
    {
        let mut wanted = ty.format(*value);
        if *within > 0.0 {
            let within = if *ty == Type::Duration { format_duration(*within as u64) } else { within.to_string() };
            wanted = format!("{wanted} ± {within}");
        }
        mismatches.push(Mismatch { what: name.clone(), expected: wanted, got: ty.format(cells[*cell]) });
    }
    if let Some(quality) = quality {
        let got = Quality::from_cell(cells[cell + 1]);
        if got != *quality {
            let (expected, got) = (quality.name().into(), got.name().into());
            mismatches.push(Mismatch { what: format!("{name}.quality"), expected, got });
        }
    }
}

/// Zeros are equal whatever their sign, and so is all that is no number.
fn equal(ty: &Type, expected: u64, got: u64, within: f64) -> bool {
    let real = |cell: u64| match ty {
        Type::F32 => f64::from(f32::from_bits(cell as u32)),
        _ => f64::from_bits(cell),
    };
    match ty {
        Type::F32 | Type::F64 => {
            let (expected, got) = (real(expected), real(got));
            expected == got || (expected.is_nan() && got.is_nan()) || (expected - got).abs() <= within
        }
        Type::Bool | Type::Enum(_) | Type::Flags(_) => expected == got,
        Type::S8 | Type::S16 | Type::S32 => {
            let number = |cell: u64| i64::from((cell as u32).cast_signed());
            number(expected).abs_diff(number(got)) as f64 <= within
        }
        Type::S64 => expected.cast_signed().abs_diff(got.cast_signed()) as f64 <= within,
        _ => expected.abs_diff(got) as f64 <= within,
    }
}
