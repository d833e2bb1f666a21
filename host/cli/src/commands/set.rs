//! `latchwork set`

use super::client::{client, lines, say_done, say_json, shown, table, with_reason};
use crate::Exit;
use crate::args::operate::{Reach, Set};
use crate::report;
use anyhow::Result;
use latchwork_api::client::{Client, path_part};
use serde_json::{Map, Value, json};

pub(super) fn execute(args: &Set) -> Result<Exit> {
    let reach = &args.change.reach;
    let client = client(reach)?;
    if let Some(block) = &args.show {
        show(&client, reach, block)?;
    } else if let Some((block, what)) = staged(args) {
        let path = format!("/v1/settings/{}/{what}", path_part(block));
        say_done(reach, client.post(&path, &with_reason(json!({}), &args.change))?)?;
    } else {
        let values: Map<_, _> = args.values.iter().map(|a| (a.tag.clone(), json!(a.value))).collect();
        let body = with_reason(json!({ "values": values, "write": !args.stage }), &args.change);
        match client.post("/v1/settings", &body) {
            Ok(answer) => say_done(reach, answer)?,
            Err(error) => {
                report::error(&error.into());
                return Ok(Exit::Wanting);
            }
        }
    }
    Ok(Exit::Fine)
}

/// What is to become of what is staged.
fn staged(args: &Set) -> Option<(&str, &'static str)> {
    let write = args.write.as_deref().map(|block| (block, "write"));
    write.or_else(|| args.discard.as_deref().map(|block| (block, "discard")))
}

fn show(client: &Client, reach: &Reach, block: &str) -> Result<()> {
    let answer: Value = client.get(&format!("/v1/settings/{}", path_part(block)), &[])?;
    match answer.as_array() {
        Some(rows) if !reach.json => {
            let mut table = table(["setting", "value", "quality", ""]);
            for row in rows {
                let forced = if row["forced"] == true { "forced" } else { "" };
                table.add_row([shown(&row["tag"]), shown(&row["value"]), shown(&row["quality"]), forced.into()]);
            }
            report::say(&lines(&table));
            Ok(())
        }
        _ => say_json(&answer),
    }
}
