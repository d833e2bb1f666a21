//! The columns of a table of a component's test: what each cell of a row does to its step.

use super::model::{SetCell, Step, Subject};
use super::ports::{inputs, outputs, retained, settings};
use super::steps::{Steps, all, flag};
use super::table::{Cell, Row, Rows};
use super::values::{Group, Said, good, quality_of};
use latchwork_image::{nearest, parse_duration};
use latchwork_schema::{Checker, Finding, Span};
use toml::de::DeValue;

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
        for (column, cell) in row.said(columns) {
            match cell {
                Cell::Csv(text) => {
                    if let Err(message) = reader.csv(column, text) {
                        checker.add(Finding::error(&row.span, format!("{}: {message}", row.label)));
                    }
                }
                Cell::Toml(value, span) => reader.toml(checker, column, value, span),
            }
        }
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
    let quality = |group: &Group<'_>, path: &str| {
        let path = path.strip_suffix(".quality")?;
        group.ports.iter().position(|p| p.signal && p.path == path)
    };
    match name.split_once('.') {
        Some(("inputs", path)) => match quality(&inputs(subject), path) {
            Some(port) => Some(Column::InputQuality(port)),
            None => inputs(subject).port(checker, path, span).map(Column::Input),
        },
        Some(("outputs", path)) => match quality(&outputs(subject), path) {
            Some(port) => Some(Column::OutputQuality(port)),
            None => outputs(subject).port(checker, path, span).map(Column::Output),
        },
        Some(("settings", path)) => settings(subject).port(checker, path, span).map(Column::Setting),
        Some(("state", path)) => retained(subject).port(checker, path, span).map(Column::State),
        Some(("alarms", path)) => {
            let names = &subject.class.alarms;
            flag(checker, subject.component.name(), "alarm", names, path, span).map(Column::Alarm)
        }
        _ => {
            const KNOWN: [&str; 9] =
                ["at", "name", "inputs.", "settings.", "commands", "outputs.", "alarms", "alarms.", "state."];
            let finding = Finding::error(span, format!("a table has no column `{name}`"));
            checker.add(match nearest(name, KNOWN) {
                Some(near) => finding.help(format!("did you mean `{near}`?")),
                None => finding.help("columns are at, name, inputs.PORT, settings.PORT, commands, outputs.PORT, alarms, alarms.NAME, state.FIELD"),
            });
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

impl RowReader<'_> {
    fn toml(&mut self, checker: &mut Checker, column: Column, value: &DeValue<'_>, span: &Span) {
        let said = |port| Said { port, value, span: span.clone() };
        match column {
            Column::Setting(port) => {
                let cell = settings(self.subject).constant(checker, &said(port));
                self.step.settings.extend(cell.map(|cell| (port, cell)));
            }
            Column::Input(port) => self.input(inputs(self.subject).input(checker, &said(port))),
            Column::Output(port) => {
                let expected = outputs(self.subject).expected(checker, &said(port), self.tolerance);
                self.expected(port, expected.map(|e| (e.value, e.within, e.quality)));
            }
            Column::State(port) => {
                let expected = retained(self.subject).expected(checker, &said(port), self.tolerance);
                self.step.expect.state.extend(expected);
            }
            _ => {
                // A list of words, or one word, or a switch.
                let text = match Row::words(value, span) {
                    Ok(text) => text,
                    Err(finding) => return checker.add(finding),
                };
                if let Err(message) = self.csv(column, &text) {
                    checker.add(Finding::error(span, message));
                }
            }
        }
    }

    fn csv(&mut self, column: Column, text: &str) -> Result<(), String> {
        let parse = |group: Group<'_>, port: usize| {
            let refused = |e: latchwork_image::ParseValueError| {
                format!("`{}` is {}; it takes {}", group.full(port), e.found, e.expected)
            };
            group.ports[port].ty.parse(text).map_err(refused)
        };
        let quality =
            || quality_of(text).ok_or_else(|| format!("\"{text}\" is no quality; expected good, uncertain or bad"));
        match column {
            Column::At => self.at = Some(parse_duration(text).map_err(|e| e.to_string())?),
            Column::Name => self.step.label = format!("{}, {text}", self.step.label),
            Column::Commands => self.step.commands = words(text, "command", &self.subject.class.commands)?,
            Column::Alarms => {
                let names = &self.subject.class.alarms;
                self.step.expect.alarms = Some((all(names), words(text, "alarm", names)?));
            }
            Column::Alarm(bit) => {
                let on = match text {
                    "true" | "1" => bit,
                    "false" | "0" => 0,
                    _ => return Err(format!("the alarm is \"{text}\"; it takes true or false")),
                };
                let (spoken, word) = self.step.expect.alarms.unwrap_or_default();
                self.step.expect.alarms = Some((spoken | bit, word | on));
            }
            Column::Setting(port) => {
                let cell = parse(settings(self.subject), port)?;
                self.step.settings.push((port, cell));
            }
            Column::Input(port) => {
                let group = inputs(self.subject);
                let cell = parse(group, port)?;
                self.input(good(group.cell(port), cell, group.ports[port].signal));
            }
            Column::InputQuality(port) => {
                let cell = inputs(self.subject).cell(port) + 1;
                self.input(vec![SetCell { cell, value: quality()?.cell() }]);
            }
            Column::Output(port) => {
                let cell = parse(outputs(self.subject), port)?;
                let within = outputs(self.subject).nothing(port, self.tolerance).within;
                self.expected(port, Some((Some(cell), within, None)));
            }
            Column::OutputQuality(port) => self.expected(port, Some((None, 0.0, Some(quality()?)))),
            Column::State(port) => {
                let group = retained(self.subject);
                let mut expected = group.nothing(port, self.tolerance);
                expected.value = Some(parse(group, port)?);
                self.step.expect.state.push(expected);
            }
        }
        Ok(())
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

    /// Value and quality of one output may come from two columns.
    fn expected(&mut self, port: usize, given: Option<(Option<u64>, f64, Option<latchwork_image::Quality>)>) {
        let Some((value, within, quality)) = given else { return };
        let fresh = outputs(self.subject).nothing(port, self.tolerance);
        let list = &mut self.step.expect.outputs;
        let index = list.iter().position(|e| e.cell == fresh.cell).unwrap_or_else(|| {
            list.push(fresh);
            list.len() - 1
        });
        let expected = &mut list[index];
        if value.is_some() {
            (expected.value, expected.within) = (value, within);
        }
        expected.quality = quality.or(expected.quality);
    }
}

/// `a|b`, or `none`.
fn words(text: &str, what: &str, names: &[String]) -> Result<u64, String> {
    if text == "none" {
        return Ok(0);
    }
    text.split('|').map(str::trim).try_fold(0, |word, name| match names.iter().position(|n| n == name) {
        Some(bit) => Ok(word | 1 << bit),
        None => Err(match nearest(name, names.iter().map(String::as_str)) {
            Some(near) => format!("there is no {what} \"{name}\"; did you mean \"{near}\"?"),
            None => format!("there is no {what} \"{name}\"; there are {}, or none", names.join(", ")),
        }),
    })
}
