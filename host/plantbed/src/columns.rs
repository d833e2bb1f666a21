//! The columns of a table: what each cell of a row does to its step.

use crate::model::{Input, Step};
use crate::operations::input;
use crate::steps::Steps;
use crate::tags::{Tags, unknown};
use latchwork_image::{Quality, parse_duration};
use latchwork_plant::operate::Operation;
use latchwork_schema::{Checker, Span};
use latchwork_testbed::case::kit::{self, Cells, Expected, Part, Row, Rows, Said, no_column, quality};
use toml::de::DeValue;

/// All columns, for whoever writes another.
const COLUMNS: &str =
    "at, name, inputs.POINT, inputs.POINT.quality, settings.TAG, commands, outputs.TAG, outputs.TAG.quality, alarms";

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
        reader.fill(checker, columns, &row);
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
    let group = tags.group();
    match name.split_once('.') {
        Some(("inputs", path)) => {
            let (port, column) = match group.part(checker, path, span)? {
                Part::Value(port) => (port, Column::Input(port)),
                Part::Quality(port) => (port, Column::InputQuality(port)),
            };
            tags.driven(checker, &tags.all[port].path, span).then_some(column)
        }
        Some(("settings", path)) => {
            let port = group.port(checker, path, span)?;
            tags.set(checker, path, span).then_some(Column::Setting(port))
        }
        Some(("outputs", path)) => group.part(checker, path, span).map(|part| match part {
            Part::Value(port) => Column::Output(port),
            Part::Quality(port) => Column::OutputQuality(port),
        }),
        _ => {
            no_column(checker, name, span, COLUMNS);
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

impl Cells for Reader<'_> {
    type Column = Column;

    fn value(&mut self, checker: &mut Checker, column: Column, value: &DeValue<'_>, span: &Span) -> bool {
        let said = |port| Said { port, value, span: span.clone() };
        match column {
            Column::Input(port) => {
                if let Some(Input { cell, quality, .. }) = input(checker, self.tags, &said(port)) {
                    // A plain value leaves it to a column of qualities.
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
                    self.output(port).join(expected);
                }
            }
            _ => return false,
        }
        true
    }

    fn text(&mut self, column: Column, text: &str) -> Result<(), String> {
        let (tags, group) = (self.tags, self.tags.group());
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
            Column::Input(port) => self.input(port, Some(group.parse(port, text)?), None),
            Column::InputQuality(port) => self.input(port, None, Some(quality(text)?)),
            Column::Setting(port) => self.setting(port, group.parse(port, text)?),
            Column::Output(port) => self.output(port).value = Some(group.parse(port, text)?),
            Column::OutputQuality(port) => self.output(port).quality = Some(quality(text)?),
        }
        Ok(())
    }
}

impl Reader<'_> {
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

    fn output(&mut self, port: usize) -> &mut Expected {
        self.tags.group().slot(&mut self.outputs, port, self.tolerance)
    }
}

/// The names of `a|b`, or of `none`.
fn words(text: &str, what: &str, names: &[String]) -> Result<Vec<String>, String> {
    kit::words(text, |name| match names.iter().any(|n| n == name) {
        true => Ok(name.to_owned()),
        false => {
            let (message, help) = unknown(what, names, name);
            Err(format!("{message}; {help}"))
        }
    })
}
