//! Cells of tables: what those of a component's test and of a plant's have in common.

use super::model::Expected;
use super::table::{Cell, Row};
use super::values::{Group, no_signal, quality_of};
use latchwork_image::{Quality, Type, nearest};
use latchwork_schema::check::found;
use latchwork_schema::{Checker, Finding, Span};
use toml::de::DeValue;

/// Whoever puts the cells of one row into a step.
pub trait Cells {
    /// What a column is about.
    type Column: Copy;
    /// A value in the test file; false where the column is one of words, which a CSV file has, too.
    fn value(&mut self, checker: &mut Checker, column: Self::Column, value: &DeValue<'_>, span: &Span) -> bool;
    /// A text.
    ///
    /// # Errors
    /// What is wrong with it, in a sentence.
    fn text(&mut self, column: Self::Column, text: &str) -> Result<(), String>;

    /// All cells of a row that say something.
    fn fill(&mut self, checker: &mut Checker, columns: &[Self::Column], row: &Row<'_>) {
        for (column, cell) in row.said(columns) {
            let told = match cell {
                Cell::Csv(text) => self
                    .text(column, text)
                    .map_err(|message| Finding::error(&row.span, format!("{}: {message}", row.label))),
                Cell::Toml(value, span) if !self.value(checker, column, value, span) => words_of(value, span)
                    .and_then(|text| self.text(column, &text).map_err(|message| Finding::error(span, message))),
                Cell::Toml(..) => Ok(()),
            };
            if let Err(finding) = told {
                checker.add(finding);
            }
        }
    }
}

/// Words of a cell as a CSV file has them: `a|b`, `none`, `true`.
fn words_of(value: &DeValue<'_>, span: &Span) -> Result<String, Finding> {
    Ok(match value {
        DeValue::String(text) => text.to_string(),
        DeValue::Boolean(b) => b.to_string(),
        DeValue::Array(list) if list.is_empty() => "none".into(),
        DeValue::Array(list) => {
            let word = |v: &toml::Spanned<DeValue<'_>>| match v.get_ref() {
                DeValue::String(word) => Ok(word.to_string()),
                other => Err(Finding::error(&v.span(), format!("{}; expected a string", found(other)))),
            };
            list.iter().map(word).collect::<Result<Vec<_>, _>>()?.join("|")
        }
        other => return Err(Finding::error(span, format!("the cell is {}; expected a string", found(other)))),
    })
}

/// A finding for a name that is none of the columns, which are listed with their variable parts in capitals: `inputs.PORT`.
pub fn no_column(checker: &mut Checker, name: &str, span: &Span, columns: &str) {
    let fixed = |column: &'_ str| column.find(char::is_uppercase).unwrap_or(column.len());
    let known = columns.split(", ").map(|column| &column[..fixed(column)]);
    let finding = Finding::error(span, format!("a table has no column `{name}`"));
    checker.add(match nearest(name, known) {
        Some(near) => finding.help(format!("did you mean `{near}`?")),
        None => finding.help(format!("columns are {columns}")),
    });
}

/// The words of `a|b`, or of `none`.
///
/// # Errors
/// What `word` says of one that is none.
pub fn words<T>(text: &str, word: impl Fn(&str) -> Result<T, String>) -> Result<Vec<T>, String> {
    if text == "none" { Ok(Vec::new()) } else { text.split('|').map(|name| word(name.trim())).collect() }
}

/// A quality.
///
/// # Errors
/// A sentence: the text is none.
pub fn quality(text: &str) -> Result<Quality, String> {
    quality_of(text).ok_or_else(|| format!("\"{text}\" is no quality; expected good, uncertain or bad"))
}

/// `true`, `false`, `1`, `0`; spreadsheets write `TRUE` and `FALSE`.
pub(super) fn switch(text: &str) -> Option<bool> {
    let is = |words: [&str; 2]| words.iter().any(|word| text.eq_ignore_ascii_case(word));
    if is(["true", "1"]) { Some(true) } else { is(["false", "0"]).then_some(false) }
}

/// What a column of a port is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Its value.
    Value(usize),
    /// Its quality: `PORT.quality`.
    Quality(usize),
}

impl Group<'_> {
    /// What the path of a column is about, or a finding.
    pub fn part(&self, checker: &mut Checker, path: &str, span: &Span) -> Option<Part> {
        let find = |path: &str| self.ports.iter().position(|p| p.path == path);
        // A port may itself be called so.
        let signal = path.strip_suffix(".quality").filter(|_| find(path).is_none());
        let Some(signal) = signal else { return self.port(checker, path, span).map(Part::Value) };
        let port = self.port(checker, signal, span)?;
        if !self.ports[port].signal {
            no_signal(checker, &self.full(port), &self.ports[port], span, "leave the column out");
            return None;
        }
        Some(Part::Quality(port))
    }

    /// The cell of a port from a text.
    ///
    /// # Errors
    /// A sentence: what was found, what the port takes.
    pub fn parse(&self, port: usize, text: &str) -> Result<u64, String> {
        let ty = &self.ports[port].ty;
        if let (Type::Bool, Some(on)) = (ty, switch(text)) {
            return Ok(on.into());
        }
        ty.parse(text).map_err(|e| format!("`{}` is {}; it takes {}", self.full(port), e.found, e.expected))
    }

    /// What is expected of a port, for value and quality that come from two columns.
    pub fn slot<'l>(&self, list: &'l mut Vec<Expected>, port: usize, tolerance: f64) -> &'l mut Expected {
        let fresh = self.nothing(port, tolerance);
        let at = list.iter().position(|e| e.name == fresh.name).unwrap_or_else(|| {
            list.push(fresh);
            list.len() - 1
        });
        &mut list[at]
    }
}

impl Expected {
    /// Adds what another says of the same port.
    pub fn join(&mut self, other: Self) {
        if other.value.is_some() {
            (self.value, self.within) = (other.value, other.within);
        }
        self.quality = other.quality.or(self.quality);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_switch_is_what_a_file_or_a_spreadsheet_writes() {
        for (text, on) in [
            ("true", Some(true)),
            ("TRUE", Some(true)),
            ("1", Some(true)),
            ("false", Some(false)),
            ("FALSE", Some(false)),
            ("0", Some(false)),
            ("", None),
            ("yes", None),
            ("WAHR", None),
            ("2", None),
        ] {
            assert_eq!(switch(text), on, "{text}");
        }
    }

    #[test]
    fn none_is_no_word() {
        let word = |name: &str| if name == "c" { Err("no c".to_owned()) } else { Ok(name.to_owned()) };
        assert_eq!(words("none", word), Ok(Vec::new()));
        assert_eq!(words("a | b", word), Ok(vec!["a".into(), "b".into()]));
        assert_eq!(words("a|c", word), Err("no c".into()));
    }
}
