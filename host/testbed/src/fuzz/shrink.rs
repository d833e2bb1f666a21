//! The smallest sequence that still fails: fewer steps first, then simpler times and values.

use super::sequence::{Sequence, Shrunk};
use super::shares::Look;
use super::simple::simpler;
use latchwork_block::{Class, Port};

/// Period that every step gets if it may, ns.
const PERIOD: u64 = 10_000_000;

/// Shrinks with at most `tries` further trials, and until the look is late.
pub(super) fn shrink(
    sequence: Sequence,
    class: &Class,
    defaults: &[u64],
    tries: u32,
    look: Look<'_>,
    fails: &mut dyn FnMut(&Sequence) -> bool,
) -> Shrunk {
    let mut shrinker = Shrinker { best: sequence, class, defaults, left: tries, look, over: false, fails };
    shrinker.collapse();
    loop {
        let before = shrinker.best.clone();
        shrinker.steps();
        shrinker.extras();
        shrinker.times();
        shrinker.repeats();
        shrinker.inputs();
        shrinker.settings();
        shrinker.merge();
        if shrinker.best == before || shrinker.over {
            return Shrunk { sequence: shrinker.best, smallest: !shrinker.over };
        }
    }
}

struct Shrinker<'a> {
    best: Sequence,
    class: &'a Class,
    defaults: &'a [u64],
    left: u32,
    look: Look<'a>,
    /// There was something left to try when no more could be.
    over: bool,
    fails: &'a mut dyn FnMut(&Sequence) -> bool,
}

impl Shrinker<'_> {
    /// Takes a change if the sequence still fails with it.
    fn attempt(&mut self, change: impl FnOnce(&mut Sequence)) -> bool {
        if self.over {
            return false;
        }
        let mut candidate = self.best.clone();
        change(&mut candidate);
        // A restart before the first execution is none.
        let sound = candidate.steps.first().is_some_and(|s| !s.restart);
        if !sound || candidate == self.best {
            return false;
        }
        self.over = self.left == 0 || self.look.late();
        if self.over {
            return false;
        }
        self.left -= 1;
        let fails = (self.fails)(&candidate);
        if fails {
            self.best = candidate;
        }
        fails
    }

    /// Of a sequence of thousands of executions often their number alone matters: one step for all of them.
    fn collapse(&mut self) {
        if self.best.steps.len() < 2 {
            return;
        }
        let all = u32::try_from(self.best.executions()).unwrap_or(u32::MAX);
        for pick in [self.best.steps.len() - 1, 0] {
            let taken = self.attempt(|s| {
                let mut step = s.steps.swap_remove(pick);
                (step.repeat, step.restart, step.settings) = (all, false, None);
                s.steps = vec![step];
            });
            if taken {
                return;
            }
        }
    }

    /// Leaves steps out: half of them, a quarter, …, one.
    fn steps(&mut self) {
        let mut size = self.best.steps.len() / 2;
        while size > 0 {
            let mut from = 0;
            while from < self.best.steps.len() {
                let to = (from + size).min(self.best.steps.len());
                if !self.attempt(|s| drop(s.steps.drain(from..to))) {
                    from += size;
                }
            }
            size /= 2;
        }
    }

    /// Fewer executions of a step: the fewest that still fail, if more of them always do.
    fn repeats(&mut self) {
        for i in 0..self.best.steps.len() {
            let (mut low, mut high) = (1, self.best.steps[i].repeat);
            if high == 1 || self.attempt(|s| s.steps[i].repeat = 1) {
                continue;
            }
            while low + 1 < high {
                let middle = low + (high - low) / 2;
                if self.attempt(|s| s.steps[i].repeat = middle) { high = middle } else { low = middle }
            }
        }
    }

    fn times(&mut self) {
        self.attempt(|s| s.start = 0);
        if !self.attempt(|s| s.steps.iter_mut().for_each(|s| s.elapsed = PERIOD)) {
            for i in 0..self.best.steps.len() {
                if !self.attempt(|s| s.steps[i].elapsed = PERIOD) && self.best.steps[i].elapsed != PERIOD {
                    self.simplify(&latchwork_image::Type::Duration, self.best.steps[i].elapsed, |s, cell| {
                        s.steps[i].elapsed = cell;
                    });
                }
            }
        }
    }

    /// Restarts, settings, commands.
    fn extras(&mut self) {
        self.attempt(|s| s.steps.iter_mut().for_each(|s| s.commands = 0));
        self.attempt(|s| s.steps.iter_mut().for_each(|s| s.settings = None));
        self.attempt(|s| s.steps.iter_mut().for_each(|s| s.restart = false));
        for i in 0..self.best.steps.len() {
            if self.best.steps[i].restart {
                self.attempt(|s| s.steps[i].restart = false);
            }
            if self.best.steps[i].settings.is_some() {
                self.attempt(|s| s.steps[i].settings = None);
            }
            let word = self.best.steps[i].commands;
            for bit in (0..64).map(|b| 1 << b).filter(|b| word & b != 0) {
                self.attempt(|s| s.steps[i].commands &= !bit);
            }
        }
    }

    /// Settings: those of the defaults, or simpler ones.
    fn settings(&mut self) {
        let (class, defaults) = (self.class, self.defaults);
        self.attempt(|s| s.settings = defaults.to_vec());
        for (port, given) in class.settings.iter().enumerate() {
            if !self.attempt(|s| s.settings[port] = defaults[port]) && self.best.settings[port] != defaults[port] {
                self.simplify(&given.ty, self.best.settings[port], |s, cell| s.settings[port] = cell);
            }
            for i in 0..self.best.steps.len() {
                let Some(cell) = self.best.steps[i].settings.as_ref().map(|s| s[port]) else { continue };
                let set = |s: &mut Sequence, cell| {
                    if let Some(settings) = &mut s.steps[i].settings {
                        settings[port] = cell;
                    }
                };
                let before = self.best.steps[..i].iter().rev().find_map(|s| s.settings.as_ref());
                let before = before.unwrap_or(&self.best.settings)[port];
                if cell != before && !self.attempt(|s| set(s, before)) {
                    self.simplify(&given.ty, cell, set);
                }
            }
        }
    }

    /// Inputs: 0 in all steps, or as in the step before, or simpler.
    fn inputs(&mut self) {
        let class = self.class;
        let mut at = 0;
        for Port { ty, signal, .. } in &class.inputs {
            let cells = at..at + 1 + usize::from(*signal);
            at = cells.end;
            if self.best.steps.iter().all(|s| s.inputs[cells.clone()].iter().all(|c| *c == 0)) {
                continue;
            }
            if self.attempt(|s| s.steps.iter_mut().for_each(|s| s.inputs[cells.clone()].fill(0))) {
                continue;
            }
            for cell in cells.clone() {
                let quality = cell > cells.start;
                for i in 0..self.best.steps.len() {
                    let value = self.best.steps[i].inputs[cell];
                    let before = if i == 0 { 0 } else { self.best.steps[i - 1].inputs[cell] };
                    if value == before || self.attempt(|s| s.steps[i].inputs[cell] = before) {
                        continue;
                    }
                    if quality {
                        self.attempt(|s| s.steps[i].inputs[cell] = 0);
                    } else {
                        // Steps that hold the value go on holding it.
                        let last = self.best.steps[i..].iter().take_while(|s| s.inputs[cell] == value).count() + i;
                        self.simplify(ty, value, |s, value| {
                            s.steps[i..last].iter_mut().for_each(|s| s.inputs[cell] = value);
                        });
                    }
                }
            }
        }
    }

    /// Neighbours that differ in nothing become one step.
    fn merge(&mut self) {
        let mut i = 1;
        while i < self.best.steps.len() {
            let (one, next) = (&self.best.steps[i - 1], &self.best.steps[i]);
            let plain = !next.restart && next.settings.is_none() && next.commands == 0;
            let alike = plain && one.inputs == next.inputs && one.elapsed == next.elapsed;
            let merged = alike
                && self.attempt(|s| {
                    let next = s.steps.remove(i);
                    s.steps[i - 1].repeat = s.steps[i - 1].repeat.saturating_add(next.repeat);
                });
            i += usize::from(!merged);
        }
    }

    /// One simpler value after the other, as long as it still fails.
    fn simplify(&mut self, ty: &latchwork_image::Type, mut cell: u64, set: impl Fn(&mut Sequence, u64)) {
        while let Some(simple) = simpler(ty, cell).into_iter().find(|c| self.attempt(|s| set(s, *c))) {
            cell = simple;
        }
    }
}
