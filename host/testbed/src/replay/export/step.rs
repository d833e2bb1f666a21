//! One execution as a step of a test file.

use crate::constant::constant;
use latchwork_block::{Class, Port, Scan};
use latchwork_image::{Quality, format_duration};
use std::fmt::Write;

/// One execution, with what came before it.
pub(super) struct Step {
    pub(super) scan: Scan,
    pub(super) inputs: Vec<(usize, u64)>,
    pub(super) commands: u64,
    pub(super) settings: Option<Vec<(usize, u64)>>,
    pub(super) refused: Option<String>,
    pub(super) restart: bool,
    pub(super) outputs: Vec<(usize, u64)>,
    pub(super) alarms: Option<u64>,
    pub(super) fault: Option<&'static str>,
}

impl Step {
    /// Nothing is new: an execution of the grid.
    pub(super) fn is_dull(&self) -> bool {
        self.inputs.is_empty()
            && self.commands == 0
            && self.settings.is_none()
            && !self.restart
            && self.outputs.is_empty()
            && self.alarms.is_none()
            && self.fault.is_none()
    }

    /// As a step of a test file.
    pub(super) fn write(&self, text: &mut String, class: &Class, start: u64) {
        let _ = writeln!(text, "\n[[case.step]]\nat = {:?}", format_duration(self.scan.now - start));
        if self.restart {
            text.push_str("restart = true\n");
        }
        if let Some(settings) = self.settings.as_ref().filter(|s| !s.is_empty()) {
            let pairs = settings.iter().map(|(i, cell)| {
                let port = &class.settings[*i];
                format!("{} = {}", port.path, constant(&port.ty, *cell))
            });
            let _ = writeln!(text, "settings = {{ {} }}", pairs.collect::<Vec<_>>().join(", "));
        }
        if !self.inputs.is_empty() {
            let _ = writeln!(text, "inputs = {{ {} }}", signals(&class.inputs, &self.inputs));
        }
        if self.commands != 0 {
            let _ = writeln!(text, "commands = {}", names(&class.commands, self.commands));
        }
        let mut expect = Vec::new();
        if !self.outputs.is_empty() {
            expect.push(format!("outputs = {{ {} }}", signals(&class.outputs, &self.outputs)));
        }
        if let Some(alarms) = self.alarms {
            expect.push(format!("alarms = {}", names(&class.alarms, alarms)));
        }
        if let Some(refused) = &self.refused {
            expect.push(format!("refused = {refused:?}"));
        }
        if let Some(fault) = self.fault {
            expect.push(format!("fault = {fault:?}"));
        }
        if !expect.is_empty() {
            let _ = writeln!(text, "expect = {{ {} }}", expect.join(", "));
        }
    }
}

/// Cells that are others than before.
pub(super) fn changes(old: &[u64], new: &[u64]) -> Vec<(usize, u64)> {
    let differ = old.iter().zip(new).enumerate().filter(|(_, (a, b))| a != b);
    differ.map(|(i, (_, new))| (i, *new)).collect()
}

/// The same, but of a signal value and quality together: without a quality it would be good.
pub(super) fn input_changes(ports: &[Port], old: &[u64], new: &[u64]) -> Vec<(usize, u64)> {
    let (mut at, mut changed) = (0, Vec::new());
    for port in ports {
        let cells = at..at + 1 + usize::from(port.signal);
        if old[cells.clone()] != new[cells.clone()] {
            changed.extend(cells.clone().map(|i| (i, new[i])));
        }
        at = cells.end;
    }
    changed
}

/// Changed cells by port.
fn signals(ports: &[Port], changed: &[(usize, u64)]) -> String {
    let (mut at, mut pairs) = (0, Vec::new());
    let cell = |at: usize| changed.iter().find(|(i, _)| *i == at).map(|(_, cell)| *cell);
    for port in ports {
        let own = cell(at);
        let quality = if port.signal { cell(at + 1).map(|q| Quality::from_cell(q).name()) } else { None };
        at += 1 + usize::from(port.signal);
        let shown = own.map(|own| constant(&port.ty, own));
        let said = match (shown, quality) {
            (Some(value), None) => value,
            (Some(value), Some("good")) => value,
            (Some(value), Some(quality)) => format!("{{ value = {value}, quality = {quality:?} }}"),
            (None, Some(quality)) => format!("{{ quality = {quality:?} }}"),
            (None, None) => continue,
        };
        pairs.push(format!("{} = {said}", port.path));
    }
    pairs.join(", ")
}

fn names(of: &[String], bits: u64) -> String {
    let on: Vec<_> = of.iter().enumerate().filter(|(i, _)| bits >> i & 1 == 1).map(|(_, n)| format!("{n:?}")).collect();
    format!("[{}]", on.join(", "))
}
