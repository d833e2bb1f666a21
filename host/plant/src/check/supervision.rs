//! `[table.NAME]` and `[heartbeat]`.

use super::tags::Tags;
use crate::file::{PlantFile, TableEntry};
use crate::model::{Heartbeat, StatusTable, TagRef};
use globset::Glob;
use latchwork_schema::{Checker, Finding, Value};

/// Time between two records of a table that says nothing of it, ns.
const EVERY: u64 = 100_000_000;

pub(super) fn tables(checker: &mut Checker, file: &PlantFile, tags: &Tags) -> Vec<StatusTable> {
    let table = |entry: &TableEntry| StatusTable {
        name: entry.name.clone(),
        tags: members(checker, entry, tags),
        every: entry.values.duration("every").unwrap_or(EVERY),
    };
    file.tables.iter().map(table).collect()
}

fn members(checker: &mut Checker, entry: &TableEntry, tags: &Tags) -> Vec<TagRef> {
    let Some(Value::List(names)) = entry.values.get("tags") else { return Vec::new() };
    let mut members: Vec<(String, TagRef)> = Vec::new();
    for (name, span) in names {
        let Value::Text(name) = name else { continue };
        if !name.contains(['*', '?', '[', '{']) {
            members.extend(tags.find(checker, name, span).map(|t| (name.clone(), t.tag)));
            continue;
        }
        let matcher = match Glob::new(name) {
            Ok(glob) => glob.compile_matcher(),
            Err(error) => {
                let message = format!("\"{name}\" is no glob of tags: {}", error.kind());
                checker.add(Finding::error(span, message).help("use * and ?, as in \"unit.outputs.*\""));
                continue;
            }
        };
        let before = members.len();
        // Figures of lanes change with every scan; they are meant only where they are named.
        let meant = |tag: &str| matcher.is_match(tag) && (!tag.starts_with("lane.") || name.starts_with("lane."));
        members.extend(tags.all().filter(|(tag, _)| meant(tag)).map(|(tag, what)| (tag.to_owned(), what)));
        if members.len() == before {
            checker.add(Finding::note(span, format!("no tag matches \"{name}\"")));
        }
    }
    members.sort_by(|a, b| a.0.cmp(&b.0));
    members.dedup();
    members.into_iter().map(|(_, tag)| tag).collect()
}

pub(super) fn heartbeat(file: &PlantFile) -> Heartbeat {
    let of = |key| file.heartbeat.as_ref().and_then(|h| h.duration(key));
    Heartbeat { send: of("send"), expect: of("expect") }
}
