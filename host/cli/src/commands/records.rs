//! `latchwork records`: what happened, and who did it.

use super::client::{client, plain, shown};
use crate::Exit;
use crate::args::operate::Records;
use crate::report;
use anyhow::Result;
use latchwork_api::client::Client;
use latchwork_record::rfc3339;
use serde::Deserialize;
use serde_json::Value;
use std::time::Duration;

#[derive(Deserialize)]
struct Row {
    seq: u64,
    time: String,
    kind: String,
    source: String,
    transition: String,
    previous: Value,
    current: Value,
    user: String,
    text: String,
}

#[derive(Deserialize)]
struct Found {
    records: Vec<Value>,
    next: u64,
}

pub(super) fn execute(args: &Records) -> Result<Exit> {
    let client = client(&args.reach)?;
    let mut query: Vec<(&str, String)> = Vec::new();
    query.extend(args.from.map(|ns| ("from", rfc3339(ns))));
    query.extend(args.to.map(|ns| ("to", rfc3339(ns))));
    query.extend(args.kind.clone().map(|kind| ("kind", kind)));
    query.extend(args.source.clone().map(|source| ("source", source)));
    if args.follow { follow(&client, args, query) } else { list(&client, args, query) }
}

fn list(client: &Client, args: &Records, query: Vec<(&str, String)>) -> Result<Exit> {
    let forward = args.after.is_some() || args.from.is_some();
    let (mut after, mut left) = (args.after.unwrap_or(0), args.limit);
    loop {
        let mut query = query.clone();
        if forward {
            query.push(("after", after.to_string()));
        }
        query.push(("limit", left.to_string()));
        let found: Found = client.get("/v1/records", &borrowed(&query))?;
        found.records.iter().try_for_each(|record| say(record, args.reach.json))?;
        left -= found.records.len().min(left);
        // One answer looks through a part of a long journal only.
        if !forward || left == 0 || found.next == after {
            return Ok(Exit::Fine);
        }
        after = found.next;
    }
}

fn follow(client: &Client, args: &Records, mut query: Vec<(&str, String)>) -> Result<Exit> {
    query.push(("follow", "true".into()));
    let after = args.after.or(args.from.map(|_| 0));
    query.extend(after.map(|after| ("after", after.to_string())));
    let mut lines = client.lines("/v1/records", &borrowed(&query))?;
    loop {
        if let Some(record) = lines.next(Duration::from_secs(3600))? {
            say(&record, args.reach.json)?;
        }
    }
}

fn borrowed<'a>(query: &'a [(&'a str, String)]) -> Vec<(&'a str, &'a str)> {
    query.iter().map(|(name, value)| (*name, value.as_str())).collect()
}

fn say(record: &Value, json: bool) -> Result<()> {
    let line = if json { serde_json::to_string(record)? } else { line(&Row::deserialize(record)?) };
    report::say(&(line + "\n"));
    Ok(())
}

fn line(row: &Row) -> String {
    let time = row.time.get(..23).unwrap_or(&row.time).replace('T', " ");
    let mut line =
        format!("{:>7}  {time}  {:<9} {}  {}", row.seq, plain(&row.kind), plain(&row.source), plain(&row.transition));
    match (&row.previous, &row.current) {
        (Value::Null, Value::Null) => {}
        (Value::Null, current) => line += &format!("  {}", shown(current)),
        (previous, current) => line += &format!("  {} → {}", shown(previous), shown(current)),
    }
    if !row.user.is_empty() {
        line += &format!("  by {}", plain(&row.user));
    }
    if !row.text.is_empty() {
        line += &format!("  {}", plain(&row.text));
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_record_is_a_line_with_who_did_it() {
        let record = |previous: Value, current: Value, user: &str, text: &str| {
            let record = json!({
                "seq": 17, "time": "2026-11-27T03:12:44.103250000Z", "kind": "setting", "source": "unit.settings.pulse",
                "transition": "written", "previous": previous, "current": current, "user": user, "text": text, "priority": 0,
            });
            line(&Row::deserialize(&record).expect("a record"))
        };
        let lines = [
            record(json!("200ms"), json!("300ms"), "alice", "horn too short (cli)"),
            record(Value::Null, json!(true), "", ""),
            record(Value::Null, Value::Null, "bob", "\x1b[2J"),
        ];
        insta::assert_snapshot!(lines.join("\n"), @r"
             17  2026-11-27 03:12:44.103  setting   unit.settings.pulse  written  200ms → 300ms  by alice  horn too short (cli)
             17  2026-11-27 03:12:44.103  setting   unit.settings.pulse  written  true
             17  2026-11-27 03:12:44.103  setting   unit.settings.pulse  written  by bob  \u{1b}[2J
        ");
    }
}
