//! How the arguments of one version of a class become those of another, and the results come back: by name.

use crate::{Class, Port};
use latchwork_image::{Quality, Type};
use std::collections::HashMap;

/// A plan for moving argument and result cells between two versions; applying it allocates nothing.
///
/// Cells are those of [`crate::Instance::execute`]: inputs, each signal's quality behind its value, then the commands word;
/// outputs likewise, then the alarms word. A port of the same name and type is the same port; a plain port and a signal of
/// the same type are, too (a plain one is good). Commands and alarms go by name, whatever their bits.
#[derive(Clone, Debug)]
pub struct Mapping {
    identity: bool,
    arguments: Moves,
    results: Moves,
}

/// Which cell comes from where.
#[derive(Clone, Debug, Default)]
struct Moves {
    /// Cells that are copied, from and to.
    copies: Box<[(u32, u32)]>,
    /// Cells that always have the same value.
    constants: Box<[(u32, u64)]>,
    /// A word of flags.
    word: Option<Word>,
}

/// A word of flags made from another one.
#[derive(Clone, Debug)]
struct Word {
    from: u32,
    to: u32,
    /// Bits before and after; all others are off.
    bits: Box<[(u8, u8)]>,
}

impl Mapping {
    /// Between the version whose cells are at hand and the one that executes.
    pub fn new(laid_out: &Class, executed: &Class) -> Self {
        let same = |a: &[Port], b: &[Port]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same_cells(a, b));
        let identity = same(&laid_out.inputs, &executed.inputs)
            && same(&laid_out.outputs, &executed.outputs)
            && laid_out.commands == executed.commands
            && laid_out.alarms == executed.alarms;
        let mut arguments = ports(&laid_out.inputs, &executed.inputs, true);
        flags(&laid_out.inputs, &laid_out.commands, &executed.inputs, &executed.commands, &mut arguments);
        let mut results = ports(&executed.outputs, &laid_out.outputs, false);
        flags(&executed.outputs, &executed.alarms, &laid_out.outputs, &laid_out.alarms, &mut results);
        Self { identity, arguments, results }
    }

    /// Both versions have the same cells: nothing need be moved.
    pub fn is_identity(&self) -> bool {
        self.identity
    }

    /// The same where the laid-out version's cells stand somewhere else: its argument `n` in cell `arguments[n]`, its result `n`
    /// in cell `results[n]`. Then whoever applies the plan hands over all cells.
    ///
    /// # Panics
    /// When there are fewer places than [`Class::argument_cells`] and [`Class::output_cells`] say.
    pub fn placed(mut self, arguments: &[u32], results: &[u32]) -> Self {
        self.identity = false;
        for (from, _) in &mut self.arguments.copies {
            *from = arguments[*from as usize];
        }
        if let Some(word) = self.arguments.word.as_mut().filter(|word| !word.bits.is_empty()) {
            word.from = arguments[word.from as usize];
        }
        for (_, to) in &mut self.results.copies {
            *to = results[*to as usize];
        }
        for (to, _) in &mut self.results.constants {
            *to = results[*to as usize];
        }
        if let Some(word) = &mut self.results.word {
            word.to = results[word.to as usize];
        }
        self
    }

    /// Where a result of the version that executes goes; `None` if nowhere.
    pub fn result(&self, executed: u32) -> Option<u32> {
        self.results.copies.iter().find(|(from, _)| *from == executed).map(|(_, to)| *to)
    }

    /// Arguments for the version that executes; a port that the other one does not have reads 0, a signal with quality bad.
    ///
    /// # Panics
    /// When there are fewer cells than [`Class::argument_cells`] says, here and below [`Class::output_cells`].
    pub fn arguments(&self, laid_out: &[u64], executed: &mut [u64]) {
        self.arguments.apply(laid_out, executed);
    }

    /// Its results as the other version's; what it does not have any more stays as it is, but the quality of a signal is bad
    /// and alarms are off.
    pub fn results(&self, executed: &[u64], laid_out: &mut [u64]) {
        self.results.apply(executed, laid_out);
    }
}

impl Moves {
    #[inline]
    fn apply(&self, from: &[u64], to: &mut [u64]) {
        for (source, target) in &self.copies {
            to[*target as usize] = from[*source as usize];
        }
        for (target, value) in &self.constants {
            to[*target as usize] = *value;
        }
        if let Some(word) = &self.word {
            let flags = if word.bits.is_empty() { 0 } else { from[word.from as usize] };
            to[word.to as usize] = word.bits.iter().fold(0, |bits, (from, to)| bits | (flags >> from & 1) << to);
        }
    }
}

fn same_cells(a: &Port, b: &Port) -> bool {
    a.path == b.path && a.ty == b.ty && a.signal == b.signal
}

/// Each port of `new` from the port of `old` that has its name and type. With `zero`, the value of any other one is 0; it stays
/// as it is without.
fn ports(old: &[Port], new: &[Port], zero: bool) -> Moves {
    let known: HashMap<(&str, &Type), (u32, bool)> =
        old.iter().zip(places(old)).map(|(p, at)| ((p.path.as_str(), &p.ty), (at, p.signal))).collect();
    let (mut copies, mut constants) = (Vec::new(), Vec::new());
    for (port, to) in new.iter().zip(places(new)) {
        let known = known.get(&(port.path.as_str(), &port.ty)).copied();
        match known {
            Some((from, _)) => copies.push((from, to)),
            None if zero => constants.push((to, 0)),
            None => {}
        }
        match known {
            _ if !port.signal => {}
            Some((from, true)) => copies.push((from + 1, to + 1)),
            Some((_, false)) => constants.push((to + 1, Quality::Good.cell())),
            None => constants.push((to + 1, Quality::Bad.cell())),
        }
    }
    Moves { copies: copies.into(), constants: constants.into(), word: None }
}

/// The cell of each port's value.
fn places(ports: &[Port]) -> impl Iterator<Item = u32> {
    ports.iter().scan(0, |next, port| {
        let at = *next;
        *next += 1 + u32::from(port.signal);
        Some(at)
    })
}

fn cells(ports: &[Port]) -> u32 {
    ports.iter().map(|p| 1 + u32::from(p.signal)).sum()
}

/// The word of flags behind the ports.
fn flags(old_ports: &[Port], old: &[String], new_ports: &[Port], new: &[String], moves: &mut Moves) {
    if new.is_empty() {
        return;
    }
    let bits = (0u8..)
        .zip(new)
        .filter_map(|(to, name)| Some((u8::try_from(old.iter().position(|n| n == name)?).ok()?, to)))
        .collect();
    moves.word = Some(Word { from: cells(old_ports), to: cells(new_ports), bits });
}
