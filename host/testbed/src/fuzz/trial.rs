//! One sequence, done to a block, its twin and the one that is restored.

mod compare;
mod told;

use super::failure::{different, fault};
use super::report::Kind;
use super::sequence::{Sequence, Step};
use hdrhistogram::Histogram;
use latchwork_block::{Class, Fault, Instance, Limits, Scan, Template};
use latchwork_image::Type;

/// Longest time that is told apart, ns.
const HOUR: u64 = 3_600_000_000_000;

pub(super) use super::failure::Failure;
pub(super) use super::sums::{Longest, Sums};

/// What the twin is told, besides what all are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Twin {
    /// Its state is asked for at restarts, as the first one's.
    pub(super) saves: bool,
    /// It gets settings that the first refused.
    pub(super) refusals: bool,
}

/// Does sequences.
pub(super) struct Trial<'a> {
    template: &'a Template,
    twin: &'a Template,
    limits: Limits,
    clock: &'a dyn Fn() -> u64,
    /// What two looks at the clock take, ns.
    overhead: u64,
    /// Types of the output cells that are reals.
    reals: Vec<Option<Type>>,
    ins: Vec<u32>,
    pub(super) sums: Sums,
    /// Of the last sequence.
    pub(super) longest: Longest,
    /// An execution that is of interest, and what it took in the last sequence, ns.
    pub(super) watched: Option<(usize, u32)>,
    pub(super) watched_ns: u64,
    /// Settings that were refused, with the sentence, by step.
    pub(super) refusals: Vec<(usize, String)>,
    /// States that were saved, by step.
    pub(super) saved: Vec<(usize, Vec<u64>)>,
    /// Memory after each power of two of executions.
    pub(super) memory: Vec<u64>,
}

/// One instance with its cells: arguments, then outputs.
struct Side {
    instance: Instance,
    cells: Vec<u64>,
}

impl Side {
    fn execute(&mut self, scan: Scan, ins: &[u32], step: &Step, commands: Option<u64>) -> Result<(), Fault> {
        self.cells[..step.inputs.len()].copy_from_slice(&step.inputs);
        if let Some(word) = commands {
            self.cells[step.inputs.len()] = word;
        }
        let done = self.instance.execute(scan, ins, ins.len() as u32, &mut self.cells);
        if self.instance.has_log() {
            self.instance.drain_log(|_, _| {});
        }
        done
    }
}

impl<'a> Trial<'a> {
    /// `twin` is the same code, but in tests of this module.
    pub(super) fn new(template: &'a Template, twin: &'a Template, limits: Limits, clock: &'a dyn Fn() -> u64) -> Self {
        let class = template.class();
        let mut reals = Vec::new();
        for port in &class.outputs {
            reals.push(Some(port.ty.clone()).filter(|ty| matches!(ty, Type::F32 | Type::F64)));
            reals.extend(port.signal.then_some(None));
        }
        reals.extend((!class.alarms.is_empty()).then_some(None));
        let sums = Sums {
            executions: 0,
            times: Histogram::new_with_bounds(1, HOUR, 2).expect("bounds that are sound"),
            restarts: 0,
            taken: 0,
            refused: 0,
            memory: 0,
            nan: vec![(false, false); reals.len()],
        };
        let overhead = (0..64).map(|_| clock().abs_diff(clock())).min().unwrap_or(0);
        Self {
            template,
            twin,
            limits,
            clock,
            overhead,
            reals,
            ins: (0..class.argument_cells() as u32).collect(),
            sums,
            longest: Longest::default(),
            watched: None,
            watched_ns: 0,
            refusals: Vec::new(),
            saved: Vec::new(),
            memory: Vec::new(),
        }
    }

    pub(super) fn class(&self) -> &'a Class {
        self.template.class()
    }

    /// Makes an instance and configures it; the inner error is its refusal.
    pub(super) fn instance(&self, template: &Template, settings: &[u64]) -> Result<Result<Instance, String>, Fault> {
        let mut instance = template.instantiate(&self.limits)?;
        Ok(instance.configure(settings)?.map(|()| instance))
    }

    fn side(&self, template: &Template, settings: &[u64]) -> Result<Option<Side>, Failure> {
        let made = self.instance(template, settings).map_err(|f| fault(&f, None, ""))?;
        let cells = vec![0; self.ins.len() + self.reals.len()];
        Ok(made.ok().map(|instance| Side { instance, cells }))
    }

    /// Does a sequence. False: its first settings are refused, so there was nothing to do.
    pub(super) fn run(&mut self, sequence: &Sequence, told: Twin) -> Result<bool, Failure> {
        (self.longest, self.refusals, self.saved) = Default::default();
        self.memory.clear();
        self.watched_ns = 0;
        let Some(first) = self.side(self.template, &sequence.settings)? else { return Ok(false) };
        let Some(twin) = self.side(self.twin, &sequence.settings)? else {
            return Err(different(Kind::NotDeterministic, "one instance refuses settings that another takes", None));
        };
        let mut run = Run {
            first,
            twin,
            restored: None,
            settings: sequence.settings.clone(),
            told,
            scan: Scan { now: sequence.start, elapsed: 0, first: true },
            finite: self.finite(&sequence.settings, |c| &c.settings),
            done: 0,
        };
        for number in 0..sequence.steps.len() {
            self.step(&mut run, sequence, number)?;
        }
        Ok(true)
    }

    fn step(&mut self, run: &mut Run, sequence: &Sequence, number: usize) -> Result<(), Failure> {
        let step = &sequence.steps[number];
        let at = Some((number, 0));
        if step.restart {
            self.restart(run, number)?;
        }
        if let Some(settings) = &step.settings {
            self.configure(run, settings, number)?;
        }
        run.finite &= self.finite(&step.inputs, |c| &c.inputs);
        for execution in 0..step.repeat {
            let at = at.map(|(step, _)| (step, execution));
            run.scan.elapsed = sequence.elapsed(number, execution);
            run.scan.now = run.scan.now.saturating_add(run.scan.elapsed);
            let commands = if execution == 0 { step.commands } else { 0 };
            let commands = (self.ins.len() > step.inputs.len()).then_some(commands);
            let begun = (self.clock)();
            let done = run.first.execute(run.scan, &self.ins, step, commands);
            let ns = (self.clock)().saturating_sub(begun).saturating_sub(self.overhead);
            self.sums.executions += 1;
            self.sums.times.saturating_record(ns);
            if ns > self.longest.ns {
                self.longest = Longest { ns, step: number, execution };
            }
            if self.watched == at {
                self.watched_ns = ns;
            }
            done.map_err(|f| fault(&f, at, ""))?;
            self.look(run);
            let twin = run.twin.execute(run.scan, &self.ins, step, commands);
            twin.map_err(|f| match fault(&f, at, "") {
                // Whoever was only just in time the first time.
                late if late.kind == Kind::Budget => late,
                _ => different(Kind::NotDeterministic, &format!("of two instances one faults: {f}"), at),
            })?;
            self.same(run, &run.twin, Kind::NotDeterministic, at)?;
            if let Some(mut restored) = run.restored.take() {
                let done = restored.execute(run.scan, &self.ins, step, commands);
                done.map_err(|f| fault(&f, at, "after a restart, "))?;
                self.same(run, &restored, Kind::NotRestored, at)?;
                run.restored = Some(restored);
            }
            run.scan.first = false;
        }
        Ok(())
    }
}

/// A sequence under way.
struct Run {
    first: Side,
    twin: Side,
    restored: Option<Side>,
    /// Settings in force.
    settings: Vec<u64>,
    told: Twin,
    scan: Scan,
    /// No input or setting so far was NaN or infinite.
    finite: bool,
    /// Executions.
    done: u64,
}
