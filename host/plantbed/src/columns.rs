//! The columns of a table: what each cell of a row does to its step.

use crate::model::{Input, Step};
use crate::operations::input;
use crate::steps::Steps;
use crate::tags::{Tags, unknown};
use latchwork_image::{Quality, nearest, parse_duration};
use latchwork_plant::operate::Operation;
use latchwork_schema::{Checker, Finding, Span};
use latchwork_testbed::case::kit::{Cell, Expected, Row, Rows, Said, quality_of};
use toml::de::DeValue;

/// What a column is about; tags by their index.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Column {
    At,
    Name,
    Commands,
    Alarms,
    Input(usize),
    InputQuality(usize),
    Setting(usize),
    Output(usize),
    OutputQuality(usize),
}

impl Rows for Steps {
    type Column = Column;

    fn column(&mut self, checker: &mut Checker, name: &str, span: &Span) -> Option<Column> {
        column(checker, self.tags.as_ref()?, name, span)
    }

    fn row(&mut self, checker: &mut Checker, columns: &[Column], row: Row<'_>) {
        let Some(tags) = self.tags.take() else { return };
        let step = Step { label: row.label.clone(), line: row.line, ..Step::default() };
        let mut reader = Reader {
            tags: &tags,
            tolerance: self.tolerance,
            step,
            at: None,
            settings: Vec::new(),
            outputs: Vec::new(),
        };
        for (column, cell) in row.said(columns) {
            match cell {
                Cell::Csv(text) => {
                    if let Err(message) = reader.text(column, text) {
                        checker.add(Finding::error(&row.span, format!("{}: {message}", row.label)));
                    }
                }
                Cell::Toml(value, span) => reader.toml(checker, column, value, span),
            }
        }
        let Reader { mut step, at, settings, outputs, .. } = reader;
        if !settings.is_empty() {
            step.changes.wishes.insert(0, Operation::Set { values: settings, write: true });
        }
        self.tags = Some(tags);
        self.watch_changes(&step);
        step.expect.outputs = outputs.into_iter().map(|expected| self.watch_expected(expected)).collect();
        self.push(checker, step, at, &row.span);
    }
}

fn column(checker: &mut Checker, tags: &Tags, name: &str, span: &Span) -> Option<Column> {
    match name {
        "at" => return Some(Column::At),
        "name" => return Some(Column::Name),
        "commands" => return Some(Column::Commands),
        "alarms" => return Some(Column::Alarms),
        _ => {}
    }
    let find = |path: &str| tags.all.iter().position(|p| p.path == path);
    // A tag may itself be called so.
    let quality_column = |path: &str| path.strip_suffix(".quality").and_then(find).filter(|_| find(path).is_none());
    match name.split_once('.') {
        Some(("inputs", path)) => {
            let quality = quality_column(path);
            let port = quality.or_else(|| tags.group().port(checker, path, span))?;
            let column = if quality.is_some() { Column::InputQuality } else { Column::Input };
            tags.driven(checker, &tags.all[port].path, span).then_some(column(port))
        }
        Some(("settings", path)) => {
            let port = tags.group().port(checker, path, span)?;
            tags.set(checker, path, span).then_some(Column::Setting(port))
        }
        Some(("outputs", path)) => match quality_column(path) {
            Some(port) => Some(Column::OutputQuality(port)),
            None => tags.group().port(checker, path, span).map(Column::Output),
        },
        _ => {
            const KNOWN: [&str; 7] = ["at", "name", "inputs.", "settings.", "commands", "outputs.", "alarms"];
            let finding = Finding::error(span, format!("a table has no column `{name}`"));
            checker.add(match nearest(name, KNOWN) {
                Some(near) => finding.help(format!("did you mean `{near}`?")),
                None => finding.help(
                    "columns are at, name, inputs.POINT, inputs.POINT.quality, settings.TAG, commands, outputs.TAG, outputs.TAG.quality, alarms",
                ),
            });
            None
        }
    }
}

/// Puts the cells of one row into its step.
struct Reader<'a> {
    tags: &'a Tags,
    tolerance: f64,
    step: Step,
    at: Option<u64>,
    /// Written together.
    settings: Vec<(String, String)>,
    outputs: Vec<Expected>,
}

impl Reader<'_> {
    fn toml(&mut self, checker: &mut Checker, column: Column, value: &DeValue<'_>, span: &Span) {
        let said = |port| Said { port, value, span: span.clone() };
        match column {
            Column::Input(port) => {
                if let Some(Input { cell, quality, .. }) = input(checker, self.tags, &said(port)) {
                    self.input(port, cell, Some(quality).filter(|q| *q != Quality::Good));
                }
            }
            Column::Setting(port) => {
                if let Some(cell) = self.tags.group().constant(checker, &said(port)) {
                    self.setting(port, cell);
                }
            }
            Column::Output(port) => {
                if let Some(expected) = self.tags.group().expected(checker, &said(port), self.tolerance) {
                    let slot = self.output(port);
                    (slot.value, slot.within) = (expected.value.or(slot.value), expected.within);
                    slot.quality = expected.quality.or(slot.quality);
                }
            }
            _ => {
                let text = match Row::words(value, span) {
                    Ok(text) => text,
                    Err(finding) => return checker.add(finding),
                };
                if let Err(message) = self.text(column, &text) {
                    checker.add(Finding::error(span, message));
                }
            }
        }
    }

    fn text(&mut self, column: Column, text: &str) -> Result<(), String> {
        let tags = self.tags;
        let parse = |port: usize| {
            let refused = |e: latchwork_image::ParseValueError| {
                format!("`{}` is {}; it takes {}", tags.all[port].path, e.found, e.expected)
            };
            tags.all[port].ty.parse(text).map_err(refused)
        };
        let quality =
            || quality_of(text).ok_or_else(|| format!("\"{text}\" is no quality; expected good, uncertain or bad"));
        match column {
            Column::At => self.at = Some(parse_duration(text).map_err(|e| e.to_string())?),
            Column::Name => self.step.label = format!("{}, {text}", self.step.label),
            Column::Commands => {
                for tag in words(text, "command", tags.command_names())? {
                    self.step.changes.wishes.push(Operation::Command { tag, on: Some(true) });
                }
            }
            Column::Alarms => {
                let mut names = words(text, "alarm", tags.alarm_names())?;
                names.sort_unstable();
                self.step.expect.alarms = Some(names);
            }
            Column::Input(port) => self.input(port, Some(parse(port)?), None),
            Column::InputQuality(port) => self.input(port, None, Some(quality()?)),
            Column::Setting(port) => self.setting(port, parse(port)?),
            Column::Output(port) => self.output(port).value = Some(parse(port)?),
            Column::OutputQuality(port) => self.output(port).quality = Some(quality()?),
        }
        Ok(())
    }

    fn setting(&mut self, port: usize, cell: u64) {
        let port = &self.tags.all[port];
        self.settings.push((port.path.clone(), port.ty.format(cell)));
    }

    /// Value and quality of one point may come from two columns, in whatever order.
    fn input(&mut self, port: usize, cell: Option<u64>, quality: Option<Quality>) {
        let (tag, list) = (&self.tags.all[port].path, &mut self.step.changes.inputs);
        let at = list.iter().position(|i| i.tag == *tag).unwrap_or_else(|| {
            list.push(Input { tag: tag.clone(), cell: None, quality: Quality::Good });
            list.len() - 1
        });
        list[at].cell = cell.or(list[at].cell);
        list[at].quality = quality.unwrap_or(list[at].quality);
    }

    /// Value and quality of one tag may come from two columns.
    fn output(&mut self, port: usize) -> &mut Expected {
        let fresh = self.tags.group().nothing(port, self.tolerance);
        let at = self.outputs.iter().position(|e| e.name == fresh.name).unwrap_or_else(|| {
            self.outputs.push(fresh);
            self.outputs.len() - 1
        });
        &mut self.outputs[at]
    }
}

/// `a|b`, or `none`.
fn words(text: &str, what: &str, names: &[String]) -> Result<Vec<String>, String> {
    if text == "none" {
        return Ok(Vec::new());
    }
    let word = |name: &str| match names.iter().any(|n| n == name) {
        true => Ok(name.to_owned()),
        false => {
            let (message, help) = unknown(what, names, name);
            Err(format!("{message}; {help}"))
        }
    };
    text.split('|').map(|name| word(name.trim())).collect()
}
