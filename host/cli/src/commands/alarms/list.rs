//! The list of alarms, and what operators do with what is on it.

use crate::Exit;
use crate::args::operate::{Acknowledge, Alarms, Shelve, Which};
use crate::commands::client::{client, each, lines, plain, say_json, table, time};
use crate::report;
use anyhow::Result;
use comfy_table::{Cell, Color};
use latchwork_image::format_duration;
use serde::Deserialize;
use serde_json::{Value, json};
use std::io::IsTerminal;

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
struct Row {
    alarm: String,
    text: String,
    state: String,
    priority: u8,
    group: String,
    first_out: bool,
    condition: bool,
    quality: String,
    raised: u64,
    shelved_until: u64,
    seq: u64,
}

pub(in crate::commands) fn execute(args: &Alarms) -> Result<Exit> {
    let all = if args.all { "true" } else { "false" };
    let answer: Value = client(&args.reach)?.get("/v1/alarms", &[("all", all)])?;
    if args.reach.json {
        say_json(&answer)?;
        return Ok(Exit::Fine);
    }
    let mut rows: Vec<Row> = serde_json::from_value(answer)?;
    // What matters most, and came last, stands on top.
    rows.sort_by_key(|r| std::cmp::Reverse((r.priority, r.raised)));
    report::say(&text(&rows, std::io::stdout().is_terminal() && report::colours()));
    Ok(Exit::Fine)
}

fn text(rows: &[Row], colours: bool) -> String {
    if rows.is_empty() {
        return "no alarms\n".into();
    }
    let mut table = table(["priority", "alarm", "state", "condition", "raised (UTC)", "", "text"]);
    for row in rows {
        let mut notes: Vec<String> = Vec::new();
        if row.first_out {
            notes.push(format!("first of {}", if row.group.is_empty() { "its group" } else { &row.group }));
        }
        if row.shelved_until > 0 {
            notes.push(format!("shelved until {}", time(row.shelved_until)));
        }
        let condition = match (row.condition, row.quality == "bad") {
            (true, false) => "there",
            (false, false) => "gone",
            (true, true) => "there when last known",
            (false, true) => "gone when last known",
        };
        let state = Cell::new(plain(&row.state));
        let state = if colours && row.state == "unacknowledged" { state.fg(Color::Red) } else { state };
        let texts = [condition.to_owned(), time(row.raised), plain(&notes.join(", ")), plain(&row.text)];
        let mut cells = vec![Cell::new(row.priority), Cell::new(plain(&row.alarm)), state];
        cells.extend(texts.iter().map(Cell::new));
        table.add_row(cells);
    }
    // A terminal is known by whoever asks: the table shall not guess.
    if colours {
        table.enforce_styling();
    }
    let list = lines(&table);
    format!(
        "{list}newest record: {} (`latchwork ack --all --seen {0}` acknowledges what is listed here and no more)\n",
        newest(rows)
    )
}

fn newest(rows: &[Row]) -> u64 {
    rows.iter().map(|r| r.seq).max().unwrap_or(0)
}

/// An alarm that comes while somebody is typing is not acknowledged unseen.
pub(in crate::commands) fn acknowledge(args: &Acknowledge) -> Result<Exit> {
    let seen = match args.seen {
        Some(seen) => seen,
        None => newest(&client(&args.change.reach)?.get::<Vec<Row>>("/v1/alarms", &[])?),
    };
    let all = ["*".to_owned()];
    let alarms = if args.all { &all[..] } else { &args.alarms };
    let wish = |alarm: &String| ("/v1/alarms/acknowledge", json!({ "alarm": alarm, "seen": seen }));
    each(&args.change, alarms.iter().map(wish))
}

pub(in crate::commands) fn shelve(args: &Shelve) -> Result<Exit> {
    let duration = format_duration(args.duration);
    let wish = |alarm: &String| ("/v1/alarms/shelve", json!({ "alarm": alarm, "duration": duration }));
    each(&args.change, args.alarms.iter().map(wish))
}

/// What takes nothing but a name.
pub(in crate::commands) fn change(args: &Which, path: &'static str) -> Result<Exit> {
    each(&args.change, args.alarms.iter().map(|alarm| (path, json!({ "alarm": alarm }))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(alarm: &str, priority: u8, seq: u64) -> Row {
        Row {
            alarm: alarm.into(),
            text: "level above 50".into(),
            state: "unacknowledged".into(),
            priority,
            group: "tank".into(),
            first_out: seq == 7,
            condition: true,
            quality: "good".into(),
            raised: 1_795_771_800_000_000_000,
            shelved_until: if seq == 9 { 1_795_775_400_000_000_000 } else { 0 },
            seq,
        }
    }

    #[test]
    fn the_list_says_all_that_is_needed_to_act() {
        insta::assert_snapshot!(text(&[row("unit.alarms.high", 200, 7), row("unit.alarms.low\x1b[2J", 10, 9)], false));
        assert_eq!(text(&[], false), "no alarms\n");
        assert!(text(&[row("a", 1, 1)], true).contains("\x1b["), "colours where they are wanted");
    }
}
