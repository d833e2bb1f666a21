//! Tables: steps as rows, in the file or in a CSV file beside it.

use super::keys;
use super::tables::{get, table, tables};
use latchwork_schema::check::found;
use latchwork_schema::{Checker, Entry, Finding, Span, Value, position};
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// Largest CSV file, bytes: hundreds of thousands of rows.
const LARGEST: u64 = 64 << 20;

/// A test file, for what is told of it.
pub struct Place<'a> {
    text: &'a str,
    /// Its folder.
    pub base: PathBuf,
    /// Tables that were read.
    pub files: Vec<PathBuf>,
}

impl<'a> Place<'a> {
    /// The file at `path` with its text.
    pub fn new(path: &Path, text: &'a str) -> Self {
        Self { text, base: path.parent().unwrap_or(Path::new("")).to_path_buf(), files: Vec::new() }
    }

    /// The line of a span, from 1.
    pub fn line(&self, span: &Span) -> usize {
        position(self.text, span.start).0
    }
}

/// A cell of a row.
pub enum Cell<'t> {
    /// A value in the test file.
    Toml(&'t DeValue<'t>, Span),
    /// A text in a CSV file.
    Csv(String),
}

/// One row with where it stands, for messages.
pub struct Row<'t> {
    /// As many as there are columns.
    pub cells: Vec<Cell<'t>>,
    /// `row 3`, `bounds.csv:3`.
    pub label: String,
    /// Line of the test file, from 1.
    pub line: usize,
    /// Where it stands there; of a CSV file, where its name does.
    pub span: Span,
}

impl Row<'_> {
    /// The cells that say something, each with its column.
    pub fn said<'r, C: Copy>(&'r self, columns: &'r [C]) -> impl Iterator<Item = (C, &'r Cell<'r>)> {
        let empty = |cell: &Cell<'_>| match cell {
            Cell::Csv(text) => text.is_empty(),
            Cell::Toml(DeValue::String(text), _) => text.is_empty(),
            Cell::Toml(..) => false,
        };
        columns.iter().copied().zip(&self.cells).filter(move |(_, cell)| !empty(cell))
    }
}

/// Whoever takes the rows of tables.
pub trait Rows {
    /// What a column is about.
    type Column: Copy;
    /// The column of a name, or a finding.
    fn column(&mut self, checker: &mut Checker, name: &str, span: &Span) -> Option<Self::Column>;
    /// A row with a cell for each column.
    fn row(&mut self, checker: &mut Checker, columns: &[Self::Column], row: Row<'_>);
}

/// Reads the rows of `table = "file.csv"`, or of each `[[case.table]]`.
pub fn rows(checker: &mut Checker, place: &mut Place<'_>, entry: &Entry<'_>, to: &mut impl Rows) {
    if let DeValue::String(file) = entry.value {
        return csv(checker, place, file, &entry.span, to);
    }
    for (item, span) in tables(checker, entry, "[[case.table]] or the name of a CSV file") {
        let values = table(checker, &keys::TABLE, item, &span, &["rows"]);
        match (values.text("file"), values.get("columns")) {
            (Some(file), None) if !item.contains_key("rows") => {
                csv(checker, place, file, &values.span_of("file"), to);
            }
            (None, Some(Value::List(columns))) => inline(checker, place, columns, item, &span, to),
            _ => {
                let finding = Finding::error(&span, "a table has either a `file`, or `columns` and `rows`");
                checker.add(finding.help(
                    "as in `columns = [\"at\", \"inputs.in\", \"outputs.q\"]` and `rows = [[\"0ms\", true, false]]`",
                ));
            }
        }
    }
}

fn inline(
    checker: &mut Checker,
    place: &Place<'_>,
    columns: &[(Value, Span)],
    item: &DeTable<'_>,
    span: &Span,
    to: &mut impl Rows,
) {
    let names: Vec<(&str, Span)> = columns
        .iter()
        .filter_map(|(v, span)| if let Value::Text(t) = v { Some((t.as_str(), span.clone())) } else { None })
        .collect();
    let Some(columns) = heads(checker, &names, to) else { return };
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
        let row = Row { cells, label: format!("row {}", n + 1), line: place.line(&row.span()), span: row.span() };
        give(checker, &columns, row, to);
    }
}

fn csv(checker: &mut Checker, place: &mut Place<'_>, file: &str, span: &Span, to: &mut impl Rows) {
    let path = place.base.join(file);
    place.files.push(path.clone());
    let text = match read(&path) {
        Ok(text) => text,
        Err(error) => {
            checker.add(Finding::error(span, format!("the table {} cannot be read: {error}", path.display())));
            return;
        }
    };
    // Comments stand above the head alone: further down `#2` may be a name.
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let comments = text.lines().take_while(|l| l.starts_with('#')).count();
    let body = text.split_inclusive('\n').skip(comments).collect::<String>();
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(body.as_bytes());
    let headers = match reader.headers() {
        Ok(headers) => headers.clone(),
        Err(error) => return checker.add(Finding::error(span, format!("{file} is no table: {error}"))),
    };
    if let (1, Some(head)) = (headers.len(), headers.get(0).filter(|h| h.contains([';', '\t']))) {
        let finding = Finding::error(span, format!("{file} has one column, \"{head}\""));
        return checker
            .add(finding.help("columns are separated by commas: save it as CSV with `,` and decimals with `.`"));
    }
    let names: Vec<_> = headers.iter().map(|h| (h, span.clone())).collect();
    let Some(columns) = heads(checker, &names, to) else { return };
    let name = Path::new(file).file_name().unwrap_or_default().to_string_lossy().into_owned();
    let line = place.line(span);
    let mut any = false;
    for record in reader.records() {
        let record = match record {
            Ok(record) => record,
            Err(error) => return checker.add(Finding::error(span, format!("{file}: {error}"))),
        };
        any = true;
        if record.get(0).is_some_and(|first| first.starts_with('#')) {
            let line = record.position().map_or(0, csv::Position::line) + comments as u64;
            let finding = Finding::error(span, format!("{file}:{line} begins with `#`"));
            checker
                .add(finding.help("comments stand above the head; a row that is not to be tested is to be taken out"));
            continue;
        }
        let at = record.position().map_or(0, csv::Position::line) + comments as u64;
        let cells = record.iter().map(|c| Cell::Csv(c.into())).collect();
        give(checker, &columns, Row { cells, label: format!("{name}:{at}"), line, span: span.clone() }, to);
    }
    if !any {
        checker.add(Finding::error(span, format!("{file} has no rows below its head")));
    }
}

/// The text of a table; of something without an end, an error.
fn read(path: &Path) -> std::io::Result<String> {
    let meta = std::fs::metadata(path)?;
    if !meta.is_file() {
        return Err(std::io::Error::other("it is no file"));
    }
    if meta.len() > LARGEST {
        return Err(std::io::Error::other(format!("it has {} bytes; {LARGEST} are the most", meta.len())));
    }
    std::fs::read_to_string(path)
}

fn heads<R: Rows>(checker: &mut Checker, names: &[(&str, Span)], to: &mut R) -> Option<Vec<R::Column>> {
    let before = checker.findings.len();
    let mut columns = Vec::new();
    for (name, span) in names {
        if names.iter().filter(|(n, _)| n == name).count() > 1 {
            checker.add(Finding::error(span, format!("column `{name}` stands there more than once")));
            return None;
        }
        columns.push(to.column(checker, name, span));
    }
    // A column that is nothing without a finding: what it is about could not be loaded.
    if checker.findings.len() == before { columns.into_iter().collect() } else { None }
}

fn give<R: Rows>(checker: &mut Checker, columns: &[R::Column], row: Row<'_>, to: &mut R) {
    if row.cells.len() != columns.len() {
        let message = format!("{} has {} cells; the table has {} columns", row.label, row.cells.len(), columns.len());
        checker.add(Finding::error(&row.span, message).help("\"\" stands for a cell that says nothing"));
        return;
    }
    to.row(checker, columns, row);
}
