//! The search: sequence after sequence, until the number or the time is over.

mod closer;
#[cfg(test)]
mod tests;

use super::constants::Constants;
use super::difference::grows;
use super::generate::Generator;
use super::options::{Options, Progress};
use super::report::{Finding, Kind, Report};
use super::sequence::{Sequence, Shrunk, Step};
use super::shares::Shares;
use super::trial::{Trial, Twin};
use super::write;
use crate::case::Subject;
use fastrand::Rng;
use latchwork_block::{Class, FaultKind, Limits};
use std::ops::ControlFlow;

/// Sequences before the long one.
const WARM_UP: u64 = 64;
/// Executions of the long one, as a power of two; and the fewest by which growth is judged.
const SOAK: u32 = 16;
const LEAST_SOAK: u32 = 13;
/// Less than this is no long one.
const FEWEST: u32 = 8;
/// Note where growth is not judged.
pub(crate) const TOO_FEW: &str = "too few executions to tell whether its memory grows for ever";
/// When a block is stopped, ns, unless its budget is so long that it needs more.
const STOPPED: u64 = 50_000_000;
/// Settings that are tried until the block takes some.
const SETTINGS: u32 = 500;

/// Searches for what is wrong with a block. `clock` gives the machine's time in ns from anywhere on; the engine must be ticked
/// once in `options.tick` meanwhile. `progress` is called after every sequence and may end the search.
pub fn fuzz(
    subject: &Subject,
    options: &Options,
    clock: &dyn Fn() -> u64,
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Report {
    Search::new([subject, subject], options, clock).run(progress)
}

struct Search<'a> {
    /// Twice the same, but in tests of this module.
    subjects: [&'a Subject; 2],
    options: &'a Options,
    clock: &'a dyn Fn() -> u64,
    shares: Shares<'a>,
    trial: Trial<'a>,
    defaults: Vec<u64>,
    sequences: u64,
    worst: u64,
    findings: Vec<Finding>,
    notes: Vec<String>,
    /// Memory at which the case of a block that grows is to end.
    growth_limit: Option<u64>,
}

impl<'a> Search<'a> {
    fn new(subjects: [&'a Subject; 2], options: &'a Options, clock: &'a dyn Fn() -> u64) -> Self {
        Self {
            subjects,
            options,
            clock,
            shares: Shares::new(clock, options.time),
            trial: trial(subjects, options, clock),
            defaults: vec![0; subjects[0].class.settings.len()],
            sequences: 0,
            worst: 0,
            findings: Vec::new(),
            notes: Vec::new(),
            growth_limit: None,
        }
    }

    fn run(mut self, progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>) -> Report {
        let sequences = match (self.options.time, self.options.sequences) {
            (None, None) => Some(1000),
            (_, given) => given,
        };
        let mut generator = match self.start() {
            Some(generator) => generator,
            None => return self.report(),
        };
        loop {
            let late = self.shares.over(self.trial.sums.executions, self.sequences);
            if late || sequences.is_some_and(|n| self.sequences >= n) {
                break;
            }
            self.sequences += 1;
            let mut rng = rng(self.options.seed, self.sequences);
            let sequence = generator.sequence(&mut rng);
            self.one(&sequence);
            if self.sequences == WARM_UP {
                let power = self.soak_power(sequences);
                self.soak(&mut generator, power);
            }
            let executions = self.trial.sums.executions;
            let (time, sequences, findings) = (self.shares.passed(), self.sequences, self.findings.len());
            if progress(&Progress { time, sequences, executions, findings }).is_break() {
                break;
            }
        }
        if self.sequences < WARM_UP {
            let power = self.soak_power(sequences);
            self.soak(&mut generator, power);
        }
        self.report()
    }

    /// Settings that the block takes, and what its sequences are made from.
    fn start(&mut self) -> Option<Generator<'a>> {
        let subject = self.subjects[0];
        let limits = limits(self.options);
        let made = subject.template.instantiate(&limits).and_then(|mut i| i.defaults());
        match made {
            Ok(Some(own)) => self.defaults = own,
            Ok(None) => {}
            Err(fault) => {
                let kind = if fault.kind == FaultKind::Budget { Kind::Budget } else { Kind::Fault(fault.kind) };
                let nothing = Shrunk { sequence: self.nothing(), smallest: true };
                self.add(kind, fault.to_string(), 0, &nothing, None);
                return None;
            }
        }
        let constants = Constants::of(subject.component.bytes());
        let mut generator = Generator::new(&subject.class, self.defaults.clone(), constants);
        let mut rng = rng(self.options.seed, 0);
        for attempt in 0..SETTINGS {
            match self.trial.instance(&subject.template, &self.defaults) {
                Ok(Ok(_)) => {
                    if attempt > 0 {
                        let text = "it refuses the settings that it proposes itself, or 0 where it proposes none";
                        self.notes.push(text.into());
                    }
                    let constants = Constants::of(subject.component.bytes());
                    return Some(Generator::new(&subject.class, self.defaults.clone(), constants));
                }
                Ok(Err(_)) => self.defaults = generator.settings(&mut rng),
                Err(_) => {
                    self.one(&self.nothing());
                    return None;
                }
            }
        }
        self.notes.push(format!("it refused {SETTINGS} different settings: nothing could be executed"));
        None
    }

    /// One execution after the start.
    fn nothing(&self) -> Sequence {
        let inputs = vec![0; self.subjects[0].class.inputs.iter().map(|p| 1 + usize::from(p.signal)).sum()];
        let step = Step { restart: false, settings: None, inputs, commands: 0, elapsed: 10_000_000, repeat: 1 };
        Sequence { settings: self.defaults.clone(), start: 0, steps: vec![step] }
    }

    fn one(&mut self, sequence: &Sequence) {
        let done = self.trial.run(sequence, Twin::default());
        let longest = self.trial.longest;
        let known = self.known(Kind::Budget);
        // What was stopped is told by its failure.
        let stopped = matches!(&done, Err(failure) if failure.kind == Kind::Budget);
        let longer = longest.ns > self.worst + self.worst / 4 && !(known && stopped);
        if longer || (longest.ns > self.options.budget && !known) {
            self.slow(&sequence.until(longest.step, longest.execution), longest.ns);
        }
        if let Err(failure) = done {
            self.found(sequence, failure);
        }
    }

    /// Long runs of the same sequence: whether memory grows for ever, and what comes only after thousands of executions.
    fn soak(&mut self, generator: &mut Generator<'_>, power: u32) {
        // A block that is so slow has had its executions, and the time is over.
        if power < FEWEST {
            self.notes.push(TOO_FEW.into());
            return;
        }
        for (number, own) in [true, false].into_iter().enumerate() {
            let mut rng = rng(self.options.seed, u64::MAX - number as u64);
            let body = generator.soak(&mut rng, own);
            let long = body.looped(1 << power);
            self.one(&long);
            if power >= LEAST_SOAK && !self.known(Kind::Growth) && grows(&self.trial.memory, power, 2) {
                self.growth(&body, power);
            }
        }
        if power < LEAST_SOAK {
            self.notes.push(TOO_FEW.into());
        }
    }

    /// Executions of each of the two long sequences, as a power of two: as many as the rest of the search has, or an eighth of
    /// its time at the pace so far.
    fn soak_power(&self, sequences: Option<u64>) -> u32 {
        let by_number = sequences.map_or(SOAK, |n| n.saturating_mul(256).max(256).ilog2());
        let pace = self.shares.searching() / self.trial.sums.executions.max(1) + 1;
        let by_time = self.options.time.map_or(SOAK, |t| (t / 8 / pace).max(1).ilog2());
        by_number.min(by_time).min(SOAK)
    }

    fn class(&self) -> &'a Class {
        &self.subjects[0].class
    }

    fn known(&self, kind: Kind) -> bool {
        self.options.ignored.contains(&kind) || self.findings.iter().any(|f| f.kind == kind)
    }

    fn report(mut self) -> Report {
        let class = &self.subjects[0].class;
        let sums = &self.trial.sums;
        let names = write::output_names(class);
        for (name, (any, finite)) in names.iter().zip(&sums.nan) {
            let from = if *finite {
                "though every input and setting was a finite number"
            } else {
                "after NaN or infinity came in"
            };
            self.notes.extend(any.then(|| format!("{name} was NaN {from}")));
        }
        if class.retained.is_empty() {
            self.notes.push("its class retains nothing: it begins anew after every restart".into());
        }
        let late = self.findings.iter().any(|f| matches!(f.kind, Kind::Budget | Kind::Fault(FaultKind::Budget)));
        let budget = late.then_some(self.options.budget);
        Report {
            class: class.name.clone(),
            seed: self.options.seed,
            sequences: self.sequences,
            executions: sums.executions,
            restarts: sums.restarts,
            settings_taken: sums.taken,
            settings_refused: sums.refused,
            median_ns: sums.times.value_at_quantile(0.5),
            worst_ns: self.worst,
            memory: sums.memory,
            head: write::head(class, budget, self.growth_limit.unwrap_or(self.options.memory)),
            findings: self.findings,
            notes: self.notes,
        }
    }
}

fn trial<'a>(subjects: [&'a Subject; 2], options: &Options, clock: &'a dyn Fn() -> u64) -> Trial<'a> {
    Trial::new(&subjects[0].template, &subjects[1].template, limits(options), clock)
}

/// The engine stops only what never ends: budgets are kept by the clock.
fn limits(options: &Options) -> Limits {
    let longest = options.budget.saturating_mul(4).max(STOPPED);
    Limits { memory: options.memory, budget_ticks: longest.div_ceil(options.tick.max(1)) + 1, ..Limits::default() }
}

/// Random numbers of one sequence, whatever the others are.
fn rng(seed: u64, number: u64) -> Rng {
    let mut of_seed = Rng::with_seed(seed);
    Rng::with_seed(of_seed.u64(..) ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15))
}
