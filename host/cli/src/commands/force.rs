//! `latchwork force`, `latchwork unforce`

use super::client::{client, each, lines, plain, say_done, say_json, shown, table, time};
use crate::Exit;
use crate::args::operate::{Force, Reach, Unforce};
use crate::report;
use anyhow::Result;
use latchwork_api::client::ClientError;
use serde::Deserialize;
use serde_json::{Value, json};

#[derive(Deserialize)]
struct Row {
    tag: String,
    value: Value,
    user: String,
    since: u64,
}

pub(super) fn force(args: &Force) -> Result<Exit> {
    if args.values.is_empty() {
        return list(&args.change.reach);
    }
    let wish = |a: &crate::args::operate::Assignment| ("/v1/forces", json!({ "tag": a.tag, "value": a.value }));
    each(&args.change, args.values.iter().map(wish))
}

fn list(reach: &Reach) -> Result<Exit> {
    let answer: Value = client(reach)?.get("/v1/forces", &[])?;
    if reach.json {
        say_json(&answer)?;
        return Ok(Exit::Fine);
    }
    let rows: Vec<Row> = serde_json::from_value(answer)?;
    if rows.is_empty() {
        report::say("nothing is forced\n");
        return Ok(Exit::Fine);
    }
    let mut table = table(["tag", "held at", "by", "since (UTC)"]);
    for row in rows {
        table.add_row([plain(&row.tag), shown(&row.value), plain(&row.user), time(row.since)]);
    }
    report::say(&lines(&table));
    Ok(Exit::Fine)
}

pub(super) fn unforce(args: &Unforce) -> Result<Exit> {
    let reach = &args.change.reach;
    let client = client(reach)?;
    let mut exit = Exit::Fine;
    for tag in &args.tags {
        let mut query = vec![("tag", tag.as_str())];
        query.extend(args.change.reason.as_deref().map(|reason| ("reason", reason)));
        match client.delete("/v1/forces", &query) {
            Ok(answer) => say_done(reach, answer)?,
            Err(error @ ClientError::Refused { .. }) => {
                exit = Exit::Wanting;
                report::error(&error.into());
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(exit)
}
