//! The search: sequence after sequence, until the number or the time is over.

use super::constants::Constants;
use super::difference::{classify, differs, grows, last_execution};
use super::generate::Generator;
use super::options::{Options, Progress};
use super::report::{Finding, Kind, Report};
use super::sequence::{Sequence, Step};
use super::shrink::shrink;
use super::trial::{Failure, Trial, Twin};
use super::write;
use crate::case::Subject;
use crate::check::shown;
use fastrand::Rng;
use latchwork_block::{FaultKind, Limits};
use latchwork_image::format_duration;
use std::ops::ControlFlow;

/// Sequences before the long one.
const WARM_UP: u64 = 64;
/// Executions of the long one, as a power of two; and the fewest by which growth is judged.
const SOAK: u32 = 16;
const LEAST_SOAK: u32 = 13;
/// Note where growth is not judged.
pub(crate) const TOO_FEW: &str = "too few executions to tell whether its memory grows for ever";
/// Looks that shrinking may take when each waits until the block is stopped.
const LATE_TRIES: u32 = 150;
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
        let begun = (self.clock)();
        let (time, sequences) = match (self.options.time, self.options.sequences) {
            (None, None) => (None, Some(1000)),
            given => given,
        };
        let mut generator = match self.start() {
            Some(generator) => generator,
            None => return self.report(),
        };
        loop {
            let now = (self.clock)().saturating_sub(begun);
            if sequences.is_some_and(|n| self.sequences >= n) || time.is_some_and(|t| now >= t) {
                break;
            }
            self.sequences += 1;
            let mut rng = rng(self.options.seed, self.sequences);
            let sequence = generator.sequence(&mut rng);
            self.one(&sequence);
            if self.sequences == WARM_UP {
                let power = self.soak_power(time, sequences);
                self.soak(&mut generator, power);
            }
            let executions = self.trial.sums.executions;
            let (sequences, findings) = (self.sequences, self.findings.len());
            if progress(&Progress { time: now, sequences, executions, findings }).is_break() {
                break;
            }
        }
        if self.sequences < WARM_UP {
            let power = self.soak_power(time, sequences);
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
                self.add(kind, fault.to_string(), 0, &self.nothing(), None);
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
        if longest.ns > self.worst + self.worst / 4 || longest.ns > self.options.budget {
            self.slow(&sequence.until(longest.step, longest.execution), longest.ns);
        }
        if let Err(failure) = done {
            self.found(sequence, failure);
        }
    }

    /// An execution took long: what is as long each time is the block's doing, all else the machine's.
    fn slow(&mut self, sequence: &Sequence, first: u64) {
        let mut probe = trial(self.subjects, self.options, self.clock);
        let again = (0..2).map(|_| last_execution(&mut probe, sequence)).min().flatten();
        let Some(sure) = again.map(|ns| ns.min(first)) else { return };
        self.worst = self.worst.max(sure);
        let budget = self.options.budget;
        if sure <= budget || self.known(Kind::Budget) {
            return;
        }
        let mut fails = |s: &Sequence| (0..2).all(|_| last_execution(&mut probe, s).is_none_or(|ns| ns > budget));
        let small = shrink(sequence.clone(), &self.subjects[0].class, &self.defaults, tries(sequence), &mut fails);
        let ns = last_execution(&mut probe, &small).unwrap_or(sure);
        let message =
            format!("an execution takes {}, longer than its budget of {}", shown(ns), format_duration(budget));
        self.add(Kind::Budget, message, sequence.executions(), &small, Some(&probe));
    }

    /// A sequence went wrong: what kind it is, and the smallest sequence of that kind.
    fn found(&mut self, sequence: &Sequence, failure: Failure) {
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
                self.add(kind, failure.message, sequence.executions(), &cut, None);
            }
            return;
        }
        let tries = if kind == Kind::Budget { LATE_TRIES } else { tries(&cut) };
        let small = shrink(cut, &self.subjects[0].class, &self.defaults, tries, &mut fails);
        let message = match probe.run(&small, told) {
            Err(last) => {
                let budget = format_duration(self.options.budget);
                let message = match kind {
                    Kind::Budget => format!("an execution was stopped, long after its budget of {budget}"),
                    _ if last.message.is_empty() => differs(&probe, &last, kind),
                    _ => last.message.clone(),
                };
                let (defaults, executions) = (&self.defaults, sequence.executions());
                let case = write::case(&probe, defaults, &small, kind, Some(&last), &message);
                self.push(kind, message, executions, small.executions(), case);
                return;
            }
            Ok(_) => failure.message,
        };
        self.add(kind, message, sequence.executions(), &small, Some(&probe));
    }

    /// Long runs of the same sequence: whether memory grows for ever, and what comes only after thousands of executions.
    fn soak(&mut self, generator: &mut Generator<'_>, power: u32) {
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

    /// Grows still when it runs eight times as long: a heap that is filled once before it is swept does not.
    fn growth(&mut self, body: &Sequence, power: u32) {
        let mut probe = trial(self.subjects, self.options, self.clock);
        let mut grew = |s: &Sequence, power: u32, periods: u32| match probe.run(&s.looped(1 << power), Twin::default())
        {
            Ok(ran) => ran && grows(&probe.memory, power, periods),
            Err(failure) => failure.kind == Kind::Fault(FaultKind::Memory),
        };
        if !grew(body, power + 3, 5) {
            return;
        }
        let mut fails = |s: &Sequence| grew(s, power, 2);
        let small = shrink(body.clone(), &self.subjects[0].class, &self.defaults, 100, &mut fails);
        let _ = grew(&small, power, 2);
        let at = |power: u32| probe.memory.get(power as usize).copied().unwrap_or(self.options.memory);
        let bytes = at(power).saturating_sub(at(power - 1)) as f64 / (1u64 << (power - 1)) as f64;
        let message = format!("its memory grows by some {bytes:.0} bytes in every execution and never ends growing");
        let case = write::growth(&probe, &self.defaults, &small, 1 << (power - 1), &message);
        self.growth_limit = case.as_ref().map(|(_, limit)| *limit);
        self.push(Kind::Growth, message, body.executions(), small.executions(), case.map(|(case, _)| case));
    }

    /// Executions of the long sequences, as a power of two: as many as the rest of the search has, or an eighth of its time.
    fn soak_power(&self, time: Option<u64>, sequences: Option<u64>) -> u32 {
        let by_number = sequences.map_or(SOAK, |n| n.saturating_mul(256).max(256).ilog2());
        let typical = self.trial.sums.times.value_at_quantile(0.5) + 50;
        let by_time = time.map_or(SOAK, |t| (t / 8 / 6 / typical).max(256).ilog2());
        by_number.min(by_time).min(SOAK)
    }

    fn known(&self, kind: Kind) -> bool {
        self.options.ignored.contains(&kind) || self.findings.iter().any(|f| f.kind == kind)
    }

    fn add(&mut self, kind: Kind, message: String, found: u64, sequence: &Sequence, probe: Option<&Trial<'_>>) {
        let case = probe.and_then(|p| write::case(p, &self.defaults, sequence, kind, None, &message));
        self.push(kind, message, found, sequence.executions(), case);
    }

    fn push(&mut self, kind: Kind, message: String, executions_found: u64, executions: u64, case: Option<String>) {
        let sequence = self.sequences;
        self.findings.push(Finding { kind, message, sequence, executions_found, executions, case });
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

/// Looks that shrinking may take: fewer where each takes long.
fn tries(sequence: &Sequence) -> u32 {
    (8_000_000 / sequence.executions().max(1)).clamp(80, 2000) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use latchwork_block::{Engine, EngineOptions, Ticker};
    use std::time::Duration;

    fn shipped(engine: &Engine, name: &str) -> Subject {
        let exe = std::env::current_exe().expect("a test has a file");
        // TARGET/release/deps/NAME
        let target = exe.ancestors().nth(3).expect("the target folder");
        let path = target.join("components").join(name).with_extension("wasm");
        let component = engine.load_file(&path);
        let component = component.unwrap_or_else(|e| panic!("{}: {e}; run `cargo xtask guests` first", path.display()));
        let class = component.class(None).expect("its class");
        let template = component.template(&class).expect("it compiles");
        Subject { component, class, template }
    }

    /// No block without imports can be made to differ from itself: two blocks of the same ports stand in for one.
    #[test]
    fn instances_that_differ_by_themselves_are_not_deterministic() {
        let engine = Engine::new(EngineOptions::default()).expect("an engine");
        let options = Options { sequences: Some(50), ..Options::default() };
        let _ticker = Ticker::start(&engine, Duration::from_nanos(options.tick));
        let (on, off) = (shipped(&engine, "ton"), shipped(&engine, "tof"));
        let report = Search::new([&on, &off], &options, &|| 0).run(&mut |_| ControlFlow::Continue(()));
        let kinds: Vec<_> = report.findings.iter().map(|f| f.kind).collect();
        assert_eq!(kinds, [Kind::NotDeterministic], "{:#?}", report.findings);
        let finding = &report.findings[0];
        assert_eq!(finding.executions, 1, "one execution is enough: {finding:#?}");
        assert!(
            finding.message.ends_with(" not the same in two instances that were told the same"),
            "{}",
            finding.message
        );
        assert!(finding.case.as_deref().is_some_and(|c| c.contains("# By chance it may pass.")));
        // Each is the same as itself.
        assert_eq!(Search::new([&off, &off], &options, &|| 0).run(&mut |_| ControlFlow::Continue(())).findings, []);
    }
}
