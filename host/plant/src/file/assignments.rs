//! What stands below `inputs`, `settings`, `safe` and `[sim.feed]`: paths with their values.

use super::{Assignment, Source, sections};
use latchwork_schema::check::{constant, entries, found};
use latchwork_schema::{Checker, Finding};
use std::collections::HashSet;
use toml::de::{DeTable, DeValue};

/// Fields with values; tables are nested records, but `{ tag = … }` is a wire where wires may stand.
pub(super) fn assignments(checker: &mut Checker, fields: &DeTable<'_>, wires: bool) -> Vec<Assignment> {
    let mut list = Vec::new();
    collect(checker, fields, "", wires, &mut list);
    once(checker, &mut list);
    list
}

/// One value for each path: `a.b = 1` and `"a.b" = 2` are two keys to TOML.
fn once(checker: &mut Checker, list: &mut Vec<Assignment>) {
    let mut seen = HashSet::new();
    list.sort_by_key(|a| a.key.start);
    list.retain(|a| {
        let first = seen.insert(a.path.clone());
        if !first {
            let finding = Finding::error(&a.key, format!("`{}` is given for the second time", a.path));
            checker.add(finding.help("keep one of them"));
        }
        first
    });
}

fn collect(checker: &mut Checker, fields: &DeTable<'_>, prefix: &str, wires: bool, list: &mut Vec<Assignment>) {
    for e in entries(fields) {
        let path = format!("{prefix}{}", e.name);
        let source = match e.value {
            DeValue::Table(t) if wires && (t.contains_key("tag") || t.contains_key("not")) => {
                checker.whose = format!("the source of `{path}`");
                let values = checker.table(&[&sections::WIRE], t, e.span.clone());
                let Some(tag) = values.text("tag") else { continue };
                Source::Tag { tag: tag.into(), not: values.bool("not").unwrap_or(false) }
            }
            DeValue::Table(t) => {
                collect(checker, t, &format!("{path}."), wires, list);
                continue;
            }
            value => match constant(value) {
                Some(c) => Source::Constant(c),
                None => {
                    let or = if wires { "a tag, a constant or { tag = \"…\" }" } else { "a constant" };
                    checker.add(Finding::error(&e.span, format!("`{path}` is {}; expected {or}", found(value))));
                    continue;
                }
            },
        };
        list.push(Assignment { path, key: e.key_span, source, span: e.span });
    }
}

/// `"field.level" = "tank.outputs.level"`; without quotes TOML makes nested tables of it, which mean the same.
pub(super) fn feeds(checker: &mut Checker, tables: &DeTable<'_>) -> Vec<Assignment> {
    let mut list = Vec::new();
    collect_feeds(checker, tables, "", &mut list);
    once(checker, &mut list);
    list
}

fn collect_feeds(checker: &mut Checker, tables: &DeTable<'_>, prefix: &str, list: &mut Vec<Assignment>) {
    for e in entries(tables) {
        let path = format!("{prefix}{}", e.name);
        match e.value {
            DeValue::Table(t) if t.contains_key("tag") => {
                checker.whose = format!("the feed of `{path}`");
                let values = checker.table(&[&sections::WIRE], t, e.span.clone());
                if let Some(tag) = values.text("tag") {
                    let source = Source::Tag { tag: tag.into(), not: values.bool("not").unwrap_or(false) };
                    list.push(Assignment { path, key: e.key_span, source, span: e.span });
                }
            }
            DeValue::Table(t) => collect_feeds(checker, t, &format!("{path}."), list),
            DeValue::String(tag) => {
                let source = Source::Tag { tag: tag.to_string(), not: false };
                list.push(Assignment { path, key: e.key_span, source, span: e.span });
            }
            value => {
                let message = format!("the feed of `{path}` is {}; expected the name of a tag", found(value));
                checker.add(Finding::error(&e.span, message));
            }
        }
    }
}
