//! `latchwork status`
//!
//! What the plant says of itself is shown as it is, what it is called first: single values as lines, lists of things as tables.

use super::client::{client, lines, plain, say_json, shown, time};
use crate::Exit;
use crate::args::operate::Status;
use crate::report;
use anyhow::Result;
use comfy_table::{Table, presets};
use latchwork_image::format_duration;
use serde_json::{Map, Value};

/// What comes first, in this order; the rest comes as it comes.
const ORDER: &[&str] = &[
    "name",
    "steps",
    "plant",
    "sim",
    "epoch-ns",
    "time-ns",
    "component",
    "hash",
    "differs",
    "since",
    "until",
    "by",
    "versions",
    "class",
    "lane",
    "kind",
    "state",
    "every-ns",
    "scans",
    "overruns",
    "scan-time-ns",
    "scan-time-max-ns",
    "jitter-max-ns",
    "faults",
];

fn place(name: &str) -> usize {
    ORDER.iter().position(|n| *n == name).unwrap_or(ORDER.len())
}

pub(super) fn execute(args: &Status) -> Result<Exit> {
    let answer: Value = client(&args.reach)?.get("/v1/status", &[])?;
    if args.reach.json {
        say_json(&answer)?;
    } else {
        report::say(&text(&answer));
    }
    Ok(Exit::Fine)
}

fn text(answer: &Value) -> String {
    let Some(fields) = answer.as_object() else { return format!("{}\n", shown(answer)) };
    let fields = &with_earlier(fields.clone());
    let mut values = Table::new();
    values.load_style(presets::NOTHING);
    let mut tables = String::new();
    flat(fields, "", &mut values, &mut tables);
    format!("{}{tables}", lines(&values))
}

/// The earlier versions of all blocks as one list, which a table can show.
fn with_earlier(mut fields: Map<String, Value>) -> Map<String, Value> {
    let mut all = Vec::new();
    for block in fields.get_mut("blocks").and_then(Value::as_array_mut).into_iter().flatten() {
        let Some(block) = block.as_object_mut() else { continue };
        let name = block.get("name").cloned().unwrap_or_default();
        let Some(Value::Array(rows)) = block.remove("earlier") else { continue };
        for mut row in rows {
            if let Some(row) = row.as_object_mut() {
                row.insert("name".into(), name.clone());
            }
            all.push(row);
        }
    }
    if !all.is_empty() {
        fields.insert("earlier versions".into(), all.into());
    }
    fields
}

/// Values as lines, objects as lines with longer names, lists as tables below.
fn flat(fields: &Map<String, Value>, prefix: &str, values: &mut Table, tables: &mut String) {
    let mut fields: Vec<_> = fields.iter().collect();
    fields.sort_by_key(|(name, _)| place(name));
    for (name, value) in fields {
        let title = format!("{prefix}{}", plain(name));
        match value {
            Value::Object(inner) => flat(inner, &format!("{title} "), values, tables),
            Value::Array(rows) if rows.iter().any(Value::is_object) => *tables += &format!("\n{title}\n{}", grid(rows)),
            Value::Array(rows) if rows.is_empty() => drop(values.add_row([title, "none".into()])),
            Value::Array(rows) => {
                let list: Vec<_> = rows.iter().map(shown).collect();
                values.add_row([title, list.join(", ")]);
            }
            value => drop(values.add_row(named(&title, value))),
        }
    }
}

/// Things with the same fields, one in a row.
fn grid(rows: &[Value]) -> String {
    let mut names: Vec<&String> = Vec::new();
    for name in rows.iter().filter_map(Value::as_object).flat_map(|r| r.keys()) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names.sort_by_key(|n| place(n));
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(names.iter().map(|n| title(n)));
    for row in rows {
        let cell = |name: &&String| named(name, row.get(name.as_str()).unwrap_or(&Value::Null))[1].clone();
        table.add_row(names.iter().map(cell));
    }
    lines(&table)
}

/// The name of a column.
fn title(name: &str) -> String {
    if matches!(name, "since" | "until") {
        format!("{name} (UTC)")
    } else {
        plain(name.strip_suffix("-ns").unwrap_or(name))
    }
}

/// A value with its name; nanoseconds are shown as a duration with the digits that matter.
fn named(name: &str, value: &Value) -> [String; 2] {
    match (name.strip_suffix("-ns"), value.as_u64()) {
        (Some("epoch"), Some(ns)) => ["started (UTC)".into(), time(ns)],
        (Some(name), Some(ns)) => {
            let digits = [1_000_000_000, 1_000_000].into_iter().find(|unit| ns >= *unit).unwrap_or(1_000);
            [name.into(), format_duration(ns / (digits / 1_000) * (digits / 1_000))]
        }
        // As many digits as tell versions apart.
        _ if name == "hash" => [name.into(), shown(value).chars().take(12).collect()],
        _ if matches!(name, "since" | "until") => [title(name), time(value.as_u64().unwrap_or_default())],
        _ => [name.into(), shown(value)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn values_are_lines_and_lists_are_tables() {
        let status = json!({
            "plant": "pumps", "time-ns": 61_234_567_890u64, "forces": [], "alarms": { "active": 2, "shelved": 0 },
            "lanes": [
                { "faults": 0, "name": "main", "scan-time-max-ns": 123_456, "state": "running" },
                { "name": "trip", "state": "running\u{1b}[2J", "also": null },
            ],
            "blocks": [{ "name": "tank", "component": "tank-2", "hash": "5e".repeat(32), "differs": true, "by": "alice",
                "since": 1_795_737_600_000_000_000u64, "versions": 1, "class": "acme:tanks/tank@1.0.0",
                "earlier": [{ "steps": 1, "component": "tank", "hash": "3a".repeat(32), "by": "",
                    "since": 1_795_737_000_000_000_000u64, "until": 1_795_737_600_000_000_000u64 }] }],
        });
        insta::assert_snapshot!(text(&status));
    }
}
