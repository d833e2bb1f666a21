//! Tables within tables of a test file.

use latchwork_schema::check::{entries, found};
use latchwork_schema::{Checker, Entry, Finding, Section, Span, Value, Values};
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

/// The cases of a file whose first line is `start`, each read by `read`; no two of one name.
pub fn cases<'t, C>(
    checker: &mut Checker,
    root: &'t DeTable<'t>,
    start: &Span,
    name: impl Fn(&C) -> &str,
    mut read: impl FnMut(&mut Checker, &'t DeTable<'t>, &Span) -> Option<C>,
) -> Vec<C> {
    let mut cases: Vec<C> = Vec::new();
    let Some(entry) = get(root, "case") else {
        let finding = Finding::error(start, "the file has no [[case]]");
        checker.add(finding.help("add one: [[case]], name = \"…\", and [[case.step]]"));
        return cases;
    };
    for (item, span) in tables(checker, &entry, "[[case]]") {
        let Some(case) = read(checker, item, &span) else { continue };
        if cases.iter().any(|other| name(other) == name(&case)) {
            let finding = Finding::error(&span, format!("there is another case \"{}\"", name(&case)));
            checker.add(finding.help("a case is known by its name: give it one of its own"));
        }
        cases.push(case);
    }
    cases
}

/// The folders of `components`, as the file writes them.
pub fn folders(values: &Values) -> Option<Vec<String>> {
    let Some(Value::List(list)) = values.get("components") else { return None };
    let text = |value: &Value| if let Value::Text(text) = value { Some(text.clone()) } else { None };
    Some(list.iter().filter_map(|(value, _)| text(value)).collect())
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
