//! A sequence as a case of a test file.

use super::report::Kind;
use super::sequence::{Sequence, Shrunk};
use super::trial::{Failure, Trial};
use crate::case::keys::{BUDGET, MEMORY};
use crate::constant::constant;
use latchwork_block::{Class, Port};
use latchwork_image::{Quality, format_duration};
use latchwork_schema::format_size;
use std::fmt::Write;

/// Most steps of a case: nobody reads more.
const STEPS: usize = 2000;
/// Period of cases that are executed at their steps alone.
const BY_STEPS: &str = "0ms";

/// Names of the output cells: `outputs.q`, `outputs.level.quality`, `alarms`.
pub(super) fn output_names(class: &Class) -> Vec<String> {
    let mut names = Vec::new();
    for port in &class.outputs {
        names.push(format!("outputs.{}", port.path));
        names.extend(port.signal.then(|| format!("outputs.{}.quality", port.path)));
    }
    names.extend((!class.alarms.is_empty()).then(|| "alarms".to_owned()));
    names
}

/// What stands above the cases, below the component's name. A `budget` only where a case is about it: another one would
/// end in it on a machine that stands still.
pub(super) fn head(class: &Class, budget: Option<u64>, memory: u64) -> String {
    let budget = budget.map(|b| format!("budget = \"{}\"\n", format_duration(b.clamp(*BUDGET.start(), *BUDGET.end()))));
    let memory = memory.clamp(*MEMORY.start(), *MEMORY.end());
    format!("class = \"{}\"\n{}memory = \"{}\"\n", class.name, budget.unwrap_or_default(), format_size(memory))
}

/// A case that fails as the sequence does. `probe` has done it last.
pub(super) fn case(
    probe: &Trial<'_>,
    defaults: &[u64],
    small: &Shrunk,
    kind: Kind,
    failure: Option<&Failure>,
    message: &str,
) -> Option<String> {
    let Shrunk { sequence, smallest } = small;
    let writer = Writer { probe, class: probe.class(), defaults, sequence, smallest: *smallest, kind, failure };
    writer.case(message)
}

/// A case in which a block that grows meets a limit, and that limit; only for one step that is held.
pub(super) fn growth(
    probe: &Trial<'_>,
    defaults: &[u64],
    small: &Shrunk,
    executions: u32,
    message: &str,
) -> Option<(String, u64)> {
    let Shrunk { sequence: body, smallest } = small;
    let plain = body.steps.len() == 1 && body.steps[0].commands == 0;
    let limit = probe.memory.get(executions.ilog2() as usize - 1).copied()?;
    if !plain {
        return None;
    }
    let mut held = body.clone();
    held.steps[0].repeat = executions;
    let (class, kind, smallest) = (probe.class(), Kind::Growth, *smallest);
    let writer = Writer { probe, class, defaults, sequence: &held, smallest, kind, failure: None };
    Some((writer.case(message)?, limit))
}

struct Writer<'a> {
    probe: &'a Trial<'a>,
    class: &'a Class,
    defaults: &'a [u64],
    sequence: &'a Sequence,
    smallest: bool,
    kind: Kind,
    failure: Option<&'a Failure>,
}

/// An execution that becomes a step of the case.
struct Row {
    at: u64,
    step: usize,
    execution: u32,
    last: bool,
}

impl Writer<'_> {
    fn case(&self, message: &str) -> Option<String> {
        let every = self.every();
        let rows = self.rows(every)?;
        let mut out = format!("[[case]]\nname = {}\n", toml::Value::from(format!("fuzzed: {}", self.kind.name())));
        let period = every.map_or(BY_STEPS.into(), format_duration);
        let _ = writeln!(out, "every = \"{period}\"");
        if self.sequence.start > 0 {
            let _ = writeln!(out, "start = \"{}\"", format_duration(self.sequence.start));
        }
        let settings = self.settings(&self.sequence.settings, self.defaults);
        if !settings.is_empty() {
            let _ = writeln!(out, "settings = {{ {} }}", settings.join(", "));
        }
        let _ = writeln!(out, "# {}", message.replace(['\n', '\r'], " "));
        match self.kind {
            Kind::NotDeterministic => out.push_str("# By chance it may pass.\n"),
            Kind::Budget => {
                out.push_str("# It fails when the execution is stopped, at the earliest 10 ms after the budget.\n")
            }
            _ => {}
        }
        if !self.smallest {
            out.push_str("# There may be a smaller one: the time to look for it was over.\n");
        }
        for (number, row) in rows.iter().enumerate() {
            self.row(&mut out, row, rows.get(number + 1));
        }
        Some(out)
    }

    /// The one period of all executions that are told of any time, if there is one.
    fn every(&self) -> Option<u64> {
        let mut periods = (0..self.sequence.steps.len()).flat_map(|i| {
            let repeat = self.sequence.steps[i].repeat;
            [self.sequence.elapsed(i, 0), self.sequence.elapsed(i, repeat.min(2) - 1)]
                .into_iter()
                .skip(usize::from(i == 0 || self.sequence.steps[i].restart))
                .take(if i == 0 || self.sequence.steps[i].restart { usize::from(repeat > 1) } else { 2 })
        });
        let first = periods.next().unwrap_or(10_000_000);
        (first > 0 && first <= 3_600_000_000_000 && periods.all(|p| p == first)).then_some(first)
    }

    /// Executions that are told: those with a change and the last, or all.
    fn rows(&self, every: Option<u64>) -> Option<Vec<Row>> {
        let mut rows = Vec::new();
        let mut at = 0u64;
        let steps = &self.sequence.steps;
        for (step, given) in steps.iter().enumerate() {
            let saved_after = self.kind == Kind::SaveDisturbs && steps.get(step + 1).is_some_and(|s| s.restart);
            for execution in 0..given.repeat {
                let last = execution + 1 == given.repeat;
                at = at.saturating_add(self.sequence.elapsed(step, execution));
                let end = last && step + 1 == steps.len();
                if every.is_none() || execution == 0 || end || (last && saved_after) {
                    rows.push(Row { at, step, execution, last });
                }
            }
            if rows.len() > STEPS {
                return None;
            }
        }
        Some(rows)
    }

    fn row(&self, out: &mut String, row: &Row, next: Option<&Row>) {
        let step = &self.sequence.steps[row.step];
        let _ = writeln!(out, "\n[[case.step]]\nat = \"{}\"", format_duration(row.at));
        let mut expect = Vec::new();
        if row.execution == 0 {
            if step.restart && self.kind != Kind::SaveDisturbs {
                out.push_str("restart = true\n");
            }
            if let Some(settings) = &step.settings {
                let list = self.settings(settings, self.in_force(row.step));
                let _ = writeln!(out, "settings = {{ {} }}", list.join(", "));
            }
            if let Some((_, sentence)) = self.probe.refusals.iter().find(|(s, _)| *s == row.step) {
                expect.push(format!("refused = {}", toml::Value::from(sentence.as_str())));
            }
            self.inputs(out, row.step);
            if step.commands != 0 {
                let _ = writeln!(out, "commands = [{}]", words(&self.class.commands, step.commands));
            }
        }
        match (next, self.failure) {
            (None, Some(failure)) => expect.extend(self.outputs(failure)),
            (Some(next), _)
                if row.last && self.kind == Kind::SaveDisturbs && self.sequence.steps[next.step].restart =>
            {
                // Expecting a state is what asks for it.
                let state = self.probe.saved.iter().find(|(s, _)| *s == next.step);
                let fields = state.into_iter().flat_map(|(_, cells)| self.class.retained.iter().zip(cells));
                let list: Vec<_> = fields.map(|(port, cell)| named(port, *cell)).collect();
                expect.push(format!("state = {{ {} }}", list.join(", ")));
            }
            _ => {}
        }
        if !expect.is_empty() {
            let _ = writeln!(out, "expect = {{ {} }}", expect.join(", "));
        }
    }

    /// Settings in force before a step.
    fn in_force(&self, step: usize) -> &[u64] {
        let refused = |i: usize| self.probe.refusals.iter().any(|(s, _)| *s == i);
        let taken = (0..step).rev().filter(|i| !refused(*i)).find_map(|i| self.sequence.steps[i].settings.as_deref());
        taken.unwrap_or(&self.sequence.settings)
    }

    /// Those that differ from what they were; one of them where none does, as writing is what matters.
    fn settings(&self, cells: &[u64], before: &[u64]) -> Vec<String> {
        let ports = self.class.settings.iter().zip(cells).zip(before);
        let list: Vec<_> = ports.filter(|((_, new), old)| new != old).map(|((p, new), _)| named(p, *new)).collect();
        if list.is_empty() && !std::ptr::eq(before, self.defaults) {
            return self.class.settings.iter().zip(cells).take(1).map(|(p, cell)| named(p, *cell)).collect();
        }
        list
    }

    fn inputs(&self, out: &mut String, step: usize) {
        let inputs = &self.sequence.steps[step].inputs;
        let before = step.checked_sub(1).map(|i| &self.sequence.steps[i].inputs);
        let mut list = Vec::new();
        let mut at = 0;
        for port in &self.class.inputs {
            let cells = at..at + 1 + usize::from(port.signal);
            at = cells.end;
            let changed = match before {
                Some(before) => before[cells.clone()] != inputs[cells.clone()],
                None => inputs[cells.clone()].iter().any(|c| *c != 0),
            };
            if !changed {
                continue;
            }
            list.push(signal(port, &inputs[cells]));
        }
        if !list.is_empty() {
            let _ = writeln!(out, "inputs = {{ {} }}", list.join(", "));
        }
    }

    /// What the outputs and alarms that differ should be.
    fn outputs(&self, failure: &Failure) -> Vec<String> {
        let differing = self.probe.differing(failure);
        let (mut list, mut at) = (Vec::new(), 0);
        for port in &self.class.outputs {
            let cells = at..at + 1 + usize::from(port.signal);
            at = cells.end;
            if !differing.iter().any(|i| cells.contains(i)) {
                continue;
            }
            let value = constant(&port.ty, failure.expected[cells.start]);
            list.push(match port.signal {
                true => {
                    let quality = Quality::from_cell(failure.expected[cells.start + 1]).name();
                    format!("{} = {{ value = {value}, quality = \"{quality}\" }}", port.path)
                }
                false => format!("{} = {value}", port.path),
            });
        }
        let mut expect = Vec::new();
        expect.extend((!list.is_empty()).then(|| format!("outputs = {{ {} }}", list.join(", "))));
        if differing.contains(&at) {
            expect.push(format!("alarms = [{}]", words(&self.class.alarms, failure.expected[at])));
        }
        expect
    }
}

fn named(port: &Port, cell: u64) -> String {
    format!("{} = {}", port.path, constant(&port.ty, cell))
}

fn signal(port: &Port, cells: &[u64]) -> String {
    match cells {
        [value, quality] if *quality != Quality::Good.cell() => {
            let (value, quality) = (constant(&port.ty, *value), Quality::from_cell(*quality).name());
            format!("{} = {{ value = {value}, quality = \"{quality}\" }}", port.path)
        }
        _ => named(port, cells[0]),
    }
}

fn words(names: &[String], word: u64) -> String {
    let on = names.iter().enumerate().filter(|(i, _)| word >> i & 1 == 1);
    on.map(|(_, n)| format!("\"{n}\"")).collect::<Vec<_>>().join(", ")
}
