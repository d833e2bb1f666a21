//! `latchwork status`
//!
//! What the plant says of itself is shown as it is: single values as lines, lists of things as tables.

use super::client::{client, plain, say_json, shown};
use crate::Exit;
use crate::args::operate::Status;
use crate::report;
use anyhow::Result;
use comfy_table::{Table, presets};
use latchwork_image::format_duration;
use serde_json::{Map, Value};

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
    let mut lines = Table::new();
    lines.load_style(presets::NOTHING);
    let mut tables = String::new();
    flat(fields, "", &mut lines, &mut tables);
    format!("{}{tables}", trimmed(&lines))
}

/// Values as lines, objects as lines with longer names, lists as tables below.
fn flat(fields: &Map<String, Value>, prefix: &str, lines: &mut Table, tables: &mut String) {
    for (name, value) in fields {
        let title = format!("{prefix}{}", plain(name));
        match value {
            Value::Object(inner) => flat(inner, &format!("{title} "), lines, tables),
            Value::Array(rows) if rows.iter().any(Value::is_object) => *tables += &format!("\n{title}\n{}", grid(rows)),
            Value::Array(rows) if rows.is_empty() => drop(lines.add_row([title, "none".into()])),
            Value::Array(rows) => {
                let list: Vec<_> = rows.iter().map(shown).collect();
                lines.add_row([title, list.join(", ")]);
            }
            value => drop(lines.add_row(named(&title, value))),
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
    // What a thing is called comes first.
    names.sort_by_key(|n| n.as_str() != "name");
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(names.iter().map(|n| plain(n.strip_suffix("-ns").unwrap_or(n))));
    for row in rows {
        let cell = |name: &&String| named(name, row.get(name.as_str()).unwrap_or(&Value::Null))[1].clone();
        table.add_row(names.iter().map(cell));
    }
    trimmed(&table)
}

/// A value with its name; one in nanoseconds is shown as a duration.
fn named(name: &str, value: &Value) -> [String; 2] {
    match (name.strip_suffix("-ns"), value.as_u64()) {
        (Some(name), Some(ns)) => [name.into(), format_duration(if ns > 1_000_000 { ns / 1_000 * 1_000 } else { ns })],
        _ => [name.into(), shown(value)],
    }
}

fn trimmed(table: &Table) -> String {
    table.lines().map(|l| l.trim_end().to_owned() + "\n").collect()
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
        });
        insta::assert_snapshot!(text(&status));
    }
}
