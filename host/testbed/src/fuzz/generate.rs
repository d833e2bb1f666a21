//! Random sequences of a class.

use super::constants::Constants;
use super::sequence::{Sequence, Step};
use super::values::{Seen, elapsed, quality, value};
use fastrand::Rng;
use latchwork_block::Class;

const MS: u64 = 1_000_000;
/// Longest plant time of a sequence, ns: thirty years, as a test file takes a hundred.
const LONGEST: u64 = 30 * 365 * 24 * 3_600_000 * MS;

/// Makes sequences.
pub(super) struct Generator<'a> {
    class: &'a Class,
    /// Settings that the block takes.
    defaults: Vec<u64>,
    constants: Constants,
    seen: Seen,
}

impl<'a> Generator<'a> {
    pub(super) fn new(class: &'a Class, defaults: Vec<u64>, constants: Constants) -> Self {
        Self { class, defaults, constants, seen: Seen::default() }
    }

    /// Some settings: those of the defaults, some of them changed, or anything.
    pub(super) fn settings(&mut self, rng: &mut Rng) -> Vec<u64> {
        let change = match rng.u8(..4) {
            0 => 0.0,
            1 | 2 => 0.3,
            _ => 1.0,
        };
        let (constants, seen) = (&self.constants, &self.seen);
        let ports = self.class.settings.iter().zip(&self.defaults);
        ports
            .map(|(p, default)| if rng.f64() < change { value(rng, &p.ty, constants, seen) } else { *default })
            .collect()
    }

    /// A sequence of a few dozen executions, some of hundreds.
    pub(super) fn sequence(&mut self, rng: &mut Rng) -> Sequence {
        self.begin();
        let settings = if rng.u8(..3) > 0 { self.defaults.clone() } else { self.settings(rng) };
        self.class.settings.iter().zip(&settings).for_each(|(p, cell)| self.seen.note(&p.ty, *cell));
        let start = rng.choice([0, 0, 1_000_000_000, 1_800_000_000_000_000_000, LONGEST]).unwrap_or(0);
        let period = rng.choice([MS, 10 * MS, 10 * MS, 100 * MS, 1000 * MS]).unwrap_or(MS);
        let mut sequence = Sequence { settings, start, steps: Vec::new() };
        let mut inputs = self.zeros();
        let mut time = 0u64;
        for number in 0..rng.usize(1..=32) {
            self.change(rng, number == 0, &mut inputs, &sequence.steps);
            let mut step = self.step(rng, &inputs, number == 0);
            step.elapsed = elapsed(rng, period, &self.seen);
            let takes = step.elapsed.saturating_mul(step.repeat.into());
            if time.saturating_add(takes) > LONGEST {
                step.elapsed = period;
            }
            time = time.saturating_add(step.elapsed.saturating_mul(step.repeat.into()));
            sequence.steps.push(step);
        }
        sequence
    }

    /// A sequence to be looped for long: with the block's own settings or others, inputs that change now and then, the
    /// same period always, no restart.
    pub(super) fn soak(&mut self, rng: &mut Rng, own: bool) -> Sequence {
        self.begin();
        let settings = if own { self.defaults.clone() } else { self.settings(rng) };
        self.class.settings.iter().zip(&settings).for_each(|(p, cell)| self.seen.note(&p.ty, *cell));
        let mut inputs = self.zeros();
        let mut steps = Vec::new();
        for _ in 0..16 {
            self.change(rng, true, &mut inputs, &steps);
            let step = self.step(rng, &inputs, true);
            steps.push(Step { settings: None, restart: false, elapsed: 10 * MS, ..step });
        }
        Sequence { settings, start: 0, steps }
    }

    fn begin(&mut self) {
        self.seen.clear();
    }

    fn zeros(&self) -> Vec<u64> {
        vec![0; self.class.inputs.iter().map(|p| 1 + usize::from(p.signal)).sum()]
    }

    /// Changes some inputs: to new values, or back to those of a step before.
    fn change(&mut self, rng: &mut Rng, all: bool, inputs: &mut Vec<u64>, before: &[Step]) {
        if !all && rng.u8(..5) == 0 {
            if let Some(step) = rng.choice(before) {
                inputs.clone_from(&step.inputs);
            }
            return;
        }
        let ports = self.class.inputs.len().max(1) as f64;
        let share = if all { 0.7 } else { (1.0 + rng.f64() * 2.0) / ports };
        let mut at = 0;
        for port in &self.class.inputs {
            if rng.f64() < share {
                inputs[at] = value(rng, &port.ty, &self.constants, &self.seen);
                self.seen.note(&port.ty, inputs[at]);
                if port.signal {
                    inputs[at + 1] = quality(rng);
                }
            }
            at += 1 + usize::from(port.signal);
        }
    }

    fn step(&mut self, rng: &mut Rng, inputs: &[u64], first: bool) -> Step {
        let commands = self.class.commands.len() as u32;
        let word = match rng.u8(..16) {
            _ if commands == 0 => 0,
            0..=3 => 1 << rng.u32(..commands),
            4 => rng.u64(..) & ((1 << commands) - 1),
            _ => 0,
        };
        let settings = !self.class.settings.is_empty() && !first && rng.u8(..16) == 0;
        Step {
            restart: !self.class.retained.is_empty() && !first && rng.u8(..10) == 0,
            settings: settings.then(|| self.settings(rng)),
            inputs: inputs.to_vec(),
            commands: word,
            elapsed: 0,
            repeat: match rng.u8(..20) {
                0..=11 => 1,
                12..=16 => rng.u32(2..=8),
                _ => rng.u32(8..=64),
            },
        }
    }
}
