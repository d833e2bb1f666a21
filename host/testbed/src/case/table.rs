//! Tables: steps as rows, in the file or in a CSV file beside it.

use super::keys;
use super::model::{SetCell, Step, Subject};
use super::read::{Common, get, inputs, outputs, retained, settings, table, tables};
use super::steps::{Steps, all, flag};
use super::values::{Group, Said, good, quality_of};
use latchwork_image::{nearest, parse_duration};
use latchwork_schema::check::found;
use latchwork_schema::{Checker, Entry, Finding, Span, Value};
use std::path::Path;
use toml::de::{DeTable, DeValue};

/// What a column is about; ports by their index.
#[derive(Clone, Copy, Debug)]
enum Column {
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

/// A cell of a row.
enum Cell<'t> {
    Toml(&'t DeValue<'t>, Span),
    Csv(String),
}

/// One row with where it stands, for messages.
struct Row<'t> {
    cells: Vec<Cell<'t>>,
    label: String,
    line: usize,
    span: Span,
}

impl Steps {
    /// Adds the rows of `table = "file.csv"`, or of each `[[case.table]]`.
    pub(super) fn table(&mut self, checker: &mut Checker, common: &mut Common<'_>, entry: &Entry<'_>) {
        if let DeValue::String(file) = entry.value {
            return self.csv(checker, common, file, &entry.span);
        }
        for (item, span) in tables(checker, entry, "[[case.table]] or the name of a CSV file") {
            let values = table(checker, &keys::TABLE, item, &span, &["rows"]);
            match (values.text("file"), values.get("columns")) {
                (Some(file), None) if !item.contains_key("rows") => {
                    self.csv(checker, common, file, &values.span_of("file"));
                }
                (None, Some(Value::List(columns))) => self.rows(checker, common, columns, item, &span),
                _ => {
                    let finding = Finding::error(&span, "a table has either a `file`, or `columns` and `rows`");
                    checker.add(finding.help("as in `columns = [\"at\", \"inputs.in\", \"outputs.q\"]` and `rows = [[\"0ms\", true, false]]`"));
                }
            }
        }
    }

    fn rows(
        &mut self,
        checker: &mut Checker,
        common: &Common<'_>,
        columns: &[(Value, Span)],
        item: &DeTable<'_>,
        span: &Span,
    ) {
        let names: Vec<(&str, Span)> = columns
            .iter()
            .filter_map(|(v, span)| if let Value::Text(t) = v { Some((t.as_str(), span.clone())) } else { None })
            .collect();
        let Some(columns) = self.columns(checker, &names) else { return };
        let Some(rows) = get(item, "rows") else {
            checker.add(Finding::error(span, "the table has no `rows`").help("add `rows = [ […], […] ]`"));
            return;
        };
        let wrong = |checker: &mut Checker, value, span: &Span| {
            checker.add(Finding::error(span, format!("{}; expected rows, each a list", found(value))));
        };
        let DeValue::Array(list) = rows.value else { return wrong(checker, rows.value, &rows.span) };
        for (n, row) in list.iter().enumerate() {
            let DeValue::Array(cells) = row.get_ref() else {
                wrong(checker, row.get_ref(), &row.span());
                continue;
            };
            let cells = cells.iter().map(|c| Cell::Toml(c.get_ref(), c.span())).collect();
            let row = Row { cells, label: format!("row {}", n + 1), line: common.line(&row.span()), span: row.span() };
            self.row(checker, &columns, row);
        }
    }

    fn csv(&mut self, checker: &mut Checker, common: &mut Common<'_>, file: &str, span: &Span) {
        let path = common.base.join(file);
        common.files.push(path.clone());
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) => {
                checker.add(Finding::error(span, format!("the table {} cannot be read: {error}", path.display())));
                return;
            }
        };
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let headers = match reader.headers() {
            Ok(headers) => headers.clone(),
            Err(error) => return checker.add(Finding::error(span, format!("{file} is no table: {error}"))),
        };
        let names: Vec<_> = headers.iter().map(|h| (h, span.clone())).collect();
        let Some(columns) = self.columns(checker, &names) else { return };
        let name = Path::new(file).file_name().unwrap_or_default().to_string_lossy().into_owned();
        let line = common.line(span);
        let before = self.list.len();
        for record in reader.records() {
            let record = match record {
                Ok(record) => record,
                Err(error) => return checker.add(Finding::error(span, format!("{file}: {error}"))),
            };
            let at = record.position().map_or(0, csv::Position::line);
            let cells = record.iter().map(|c| Cell::Csv(c.into())).collect();
            self.row(checker, &columns, Row { cells, label: format!("{name}:{at}"), line, span: span.clone() });
        }
        if self.list.len() == before {
            checker.add(Finding::error(span, format!("{file} has no rows below its head")));
        }
    }

    fn columns(&self, checker: &mut Checker, names: &[(&str, Span)]) -> Option<Vec<Column>> {
        // Without its class nothing can be said about ports.
        let subject = self.subject.as_ref()?;
        let before = checker.findings.len();
        let mut columns = Vec::new();
        for (name, span) in names {
            if names.iter().filter(|(n, _)| n == name).count() > 1 {
                checker.add(Finding::error(span, format!("column `{name}` stands there more than once")));
                return None;
            }
            columns.extend(column(checker, subject, name, span));
        }
        (checker.findings.len() == before).then_some(columns)
    }

    fn row(&mut self, checker: &mut Checker, columns: &[Column], row: Row<'_>) {
        let Some(subject) = self.subject.clone() else { return };
        let Row { cells, label, line, span } = row;
        if cells.len() != columns.len() {
            let message = format!("{label} has {} cells; the table has {} columns", cells.len(), columns.len());
            checker.add(Finding::error(&span, message).help("\"\" stands for a cell that says nothing"));
            return;
        }
        let mut reader = RowReader { subject: &subject, tolerance: self.tolerance, step: Step::default(), at: None };
        reader.step.line = line;
        reader.step.label.clone_from(&label);
        for (column, cell) in columns.iter().zip(&cells) {
            match cell {
                Cell::Csv(text) if text.is_empty() => {}
                Cell::Toml(DeValue::String(text), _) if text.is_empty() => {}
                Cell::Csv(text) => {
                    if let Err(message) = reader.csv(*column, text) {
                        checker.add(Finding::error(&span, format!("{label}: {message}")));
                    }
                }
                Cell::Toml(value, span) => reader.toml(checker, *column, value, span),
            }
        }
        let (step, at) = (reader.step, reader.at);
        self.push(checker, step, at, &span);
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
                let text = match value {
                    DeValue::String(text) => text.to_string(),
                    DeValue::Boolean(b) => b.to_string(),
                    DeValue::Array(list) if list.is_empty() => "none".into(),
                    DeValue::Array(list) => {
                        list.iter().filter_map(|v| v.get_ref().as_str()).collect::<Vec<_>>().join("|")
                    }
                    other => {
                        checker.add(Finding::error(span, format!("the cell is {}; expected a string", found(other))));
                        return;
                    }
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
