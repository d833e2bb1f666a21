//! Tables within tables of a test file.

use latchwork_schema::check::{entries, found};
use latchwork_schema::{Checker, Entry, Finding, Section, Span, Values};
use toml::de::{DeTable, DeValue};

/// Reads a table by its section.
pub fn table(checker: &mut Checker, of: &Section, table: &DeTable<'_>, span: &Span, skip: &[&str]) -> Values {
    checker.whose.clear();
    checker.whose.push_str(of.name);
    checker.table_but(&[of], table, span.clone(), skip)
}

/// The tables of an array of tables, or findings.
pub fn tables<'t>(checker: &mut Checker, entry: &Entry<'t>, name: &str) -> Vec<(&'t DeTable<'t>, Span)> {
    let wrong = |checker: &mut Checker, value, span: &Span| {
        checker.add(Finding::error(span, format!("`{}` is {}; expected tables {name}", entry.name, found(value))));
    };
    let DeValue::Array(items) = entry.value else {
        wrong(checker, entry.value, &entry.span);
        return Vec::new();
    };
    let mut list = Vec::new();
    for item in items.iter() {
        match item.get_ref() {
            DeValue::Table(table) => list.push((table, item.span())),
            value => wrong(checker, value, &item.span()),
        }
    }
    list
}

/// One entry of a table.
pub fn get<'t>(table: &'t DeTable<'t>, name: &str) -> Option<Entry<'t>> {
    entries(table).into_iter().find(|e| e.name == name)
}

/// A table within a table, or a finding.
pub fn group<'t>(checker: &mut Checker, table: &'t DeTable<'t>, name: &str) -> Option<&'t DeTable<'t>> {
    let entry = get(table, name)?;
    if let DeValue::Table(table) = entry.value {
        return Some(table);
    }
    let message = format!("`{name}` is {}; expected a table, as in {name} = {{ PORT = … }}", found(entry.value));
    checker.add(Finding::error(&entry.span, message));
    None
}
