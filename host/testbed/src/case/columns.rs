//! The columns of a table of a component's test: what each cell of a row does to its step.

use super::cells::{self, Cells, Part, no_column, quality, switch};
use super::model::{Expected, SetCell, Step, Subject};
use super::ports::{inputs, outputs, retained, settings};
use super::steps::{Steps, all, flag};
use super::table::{Row, Rows};
use super::values::{Said, good};
use latchwork_image::{nearest, parse_duration};
use latchwork_schema::{Checker, Span};
use toml::de::DeValue;

/// All columns, for whoever writes another.
const COLUMNS: &str = "at, name, inputs.PORT, settings.PORT, commands, outputs.PORT, alarms, alarms.NAME, state.FIELD";

/// What a column is about; ports by their index.
#[derive(Clone, Copy, Debug)]
pub(super) enum Column {
    At,
    Name,
    Commands,
    Alarms,
    Alarm(u64),
    Setting(usize),
    Input(usize),
    InputQuality(usize),
    Output(usize),
    OutputQuality(usize),
    State(usize),
}

impl Rows for Steps {
    type Column = Column;

    fn column(&mut self, checker: &mut Checker, name: &str, span: &Span) -> Option<Column> {
        // Without its class nothing can be said about ports.
        column(checker, self.subject.as_ref()?, name, span)
    }

    fn row(&mut self, checker: &mut Checker, columns: &[Column], row: Row<'_>) {
        let Some(subject) = self.subject.clone() else { return };
        let mut reader = RowReader { subject: &subject, tolerance: self.tolerance, step: Step::default(), at: None };
        reader.step.line = row.line;
        reader.step.label.clone_from(&row.label);
        reader.fill(checker, columns, &row);
        let (step, at) = (reader.step, reader.at);
        self.push(checker, step, at, &row.span);
    }
}

fn column(checker: &mut Checker, subject: &Subject, name: &str, span: &Span) -> Option<Column> {
    match name {
        "at" => return Some(Column::At),
        "name" => return Some(Column::Name),
        "commands" => return Some(Column::Commands),
        "alarms" => return Some(Column::Alarms),
        _ => {}
    }
    match name.split_once('.') {
        Some(("inputs", path)) => inputs(subject).part(checker, path, span).map(|part| match part {
            Part::Value(port) => Column::Input(port),
            Part::Quality(port) => Column::InputQuality(port),
        }),
        Some(("outputs", path)) => outputs(subject).part(checker, path, span).map(|part| match part {
            Part::Value(port) => Column::Output(port),
            Part::Quality(port) => Column::OutputQuality(port),
        }),
        Some(("settings", path)) => settings(subject).port(checker, path, span).map(Column::Setting),
        Some(("state", path)) => retained(subject).port(checker, path, span).map(Column::State),
        Some(("alarms", path)) => {
            let names = &subject.class.alarms;
            flag(checker, subject.component.name(), "alarm", names, path, span).map(Column::Alarm)
        }
        _ => {
            no_column(checker, name, span, COLUMNS);
            None
        }
    }
}

/// Puts the cells of one row into its step.
struct RowReader<'a> {
    subject: &'a Subject,
    tolerance: f64,
    step: Step,
    at: Option<u64>,
}

impl Cells for RowReader<'_> {
    type Column = Column;

    fn value(&mut self, checker: &mut Checker, column: Column, value: &DeValue<'_>, span: &Span) -> bool {
        let said = |port| Said { port, value, span: span.clone() };
        match column {
            Column::Setting(port) => {
                let cell = settings(self.subject).constant(checker, &said(port));
                self.step.settings.extend(cell.map(|cell| (port, cell)));
            }
            Column::Input(port) => self.input(inputs(self.subject).input(checker, &said(port))),
            Column::Output(port) => {
                if let Some(expected) = outputs(self.subject).expected(checker, &said(port), self.tolerance) {
                    self.output(port).join(expected);
                }
            }
            Column::State(port) => {
                let expected = retained(self.subject).expected(checker, &said(port), self.tolerance);
                self.step.expect.state.extend(expected);
            }
            _ => return false,
        }
        true
    }

    fn text(&mut self, column: Column, text: &str) -> Result<(), String> {
        match column {
            Column::At => self.at = Some(parse_duration(text).map_err(|e| e.to_string())?),
            Column::Name => self.step.label = format!("{}, {text}", self.step.label),
            Column::Commands => self.step.commands = words(text, "command", &self.subject.class.commands)?,
            Column::Alarms => {
                let names = &self.subject.class.alarms;
                self.step.expect.alarms = Some((all(names), words(text, "alarm", names)?));
            }
            Column::Alarm(bit) => {
                let refused = || format!("the alarm is \"{text}\"; it takes true or false");
                let on = if switch(text).ok_or_else(refused)? { bit } else { 0 };
                let (spoken, word) = self.step.expect.alarms.unwrap_or_default();
                self.step.expect.alarms = Some((spoken | bit, word | on));
            }
            Column::Setting(port) => {
                let cell = settings(self.subject).parse(port, text)?;
                self.step.settings.push((port, cell));
            }
            Column::Input(port) => {
                let group = inputs(self.subject);
                let cell = group.parse(port, text)?;
                self.input(good(group.cell(port), cell, group.ports[port].signal));
            }
            Column::InputQuality(port) => {
                let cell = inputs(self.subject).cell(port) + 1;
                self.input(vec![SetCell { cell, value: quality(text)?.cell() }]);
            }
            Column::Output(port) => self.output(port).value = Some(outputs(self.subject).parse(port, text)?),
            Column::OutputQuality(port) => self.output(port).quality = Some(quality(text)?),
            Column::State(port) => {
                let group = retained(self.subject);
                let mut expected = group.nothing(port, self.tolerance);
                expected.value = Some(group.parse(port, text)?);
                self.step.expect.state.push(expected);
            }
        }
        Ok(())
    }
}

impl RowReader<'_> {
    fn output(&mut self, port: usize) -> &mut Expected {
        outputs(self.subject).slot(&mut self.step.expect.outputs, port, self.tolerance)
    }

    /// A column of qualities may stand before that of the values, which would make them good.
    fn input(&mut self, cells: Vec<SetCell>) {
        for cell in cells {
            let quality = self.step.inputs.iter().any(|c| c.cell == cell.cell);
            if !quality {
                self.step.inputs.push(cell);
            } else if cell.value != 0 {
                self.step.inputs.iter_mut().filter(|c| c.cell == cell.cell).for_each(|c| c.value = cell.value);
            }
        }
    }
}

/// The bits of `a|b`, or of `none`.
fn words(text: &str, what: &str, names: &[String]) -> Result<u64, String> {
    let bit = |name: &str| match names.iter().position(|n| n == name) {
        Some(bit) => Ok(1 << bit),
        None => Err(match nearest(name, names.iter().map(String::as_str)) {
            Some(near) => format!("there is no {what} \"{name}\"; did you mean \"{near}\"?"),
            None => format!("there is no {what} \"{name}\"; there are {}, or none", names.join(", ")),
        }),
    };
    Ok(cells::words(text, bit)?.into_iter().fold(0, |word, bit: u64| word | bit))
}
