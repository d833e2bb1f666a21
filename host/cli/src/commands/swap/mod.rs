//! `latchwork swap`, `latchwork rollback`, `latchwork swaps`

mod follow;
mod order;
mod text;

use super::client::{client, lines, plain, say_done, say_json, table, time, with_reason};
use crate::Exit;
use crate::args::swap::{Rollback, Swap, Swaps};
use crate::report;
use anyhow::{Result, anyhow};
use follow::{End, follow};
use latchwork_api::client::{Client, path_part};
use latchwork_plant::swap::{Stage, SwapStatus};
use order::{Order, Wrong};
use serde_json::{Value, json};
use std::io::{BufRead, IsTerminal};

pub(super) fn swap(args: &Swap) -> Result<Exit> {
    let reach = &args.change.reach;
    let asks = !args.yes && !args.dry_run;
    if asks && (reach.json || !can_ask()) {
        return Ok(nobody_to_ask("swap"));
    }
    let order = match Order::read(args) {
        Ok(order) => order,
        Err(Wrong::Usage { error, help }) => return Ok(usage(&error, &help)),
        Err(Wrong::File(error)) => return Err(error),
    };
    let client = client(reach)?;
    let mut told = false;
    if asks {
        let plan = start(&client, &order.body(args, true))?;
        match follow(&client, plan, false, false)? {
            End::Over(status) if status.stage == Stage::Planned => told = true,
            End::Over(status) => return Ok(outcome(&status)),
            End::Left(number) => return Ok(left(number)),
        }
        let names = order.names();
        if !agreed(&format!("swap {names} in the running plant?"))? {
            report::say("nothing was changed\n");
            return Ok(Exit::Wanting);
        }
    }
    let status = start(&client, &order.body(args, args.dry_run))?;
    end(follow(&client, status, told, reach.json)?, reach.json)
}

/// A swap under way.
fn start(client: &Client, body: &Value) -> Result<SwapStatus> {
    Ok(client.upload("/v1/swaps", serde_json::to_vec(body)?)?)
}

pub(super) fn rollback(args: &Rollback) -> Result<Exit> {
    let reach = &args.change.reach;
    if !args.yes && (reach.json || !can_ask()) {
        return Ok(nobody_to_ask("roll back"));
    }
    let client = client(reach)?;
    let versions = if args.steps == 1 { "the version before".into() } else { format!("{} versions back", args.steps) };
    if !args.yes && !agreed(&format!("roll {} back to {versions} in the running plant?", plain(&args.block)))? {
        report::say("nothing was changed\n");
        return Ok(Exit::Wanting);
    }
    let path = format!("/v1/blocks/{}/rollback", path_part(&args.block));
    let answer: Value = client.post(&path, &with_reason(json!({ "steps": args.steps }), &args.change))?;
    match serde_json::from_value::<SwapStatus>(answer.clone()) {
        Ok(status) => end(follow(&client, status, false, reach.json)?, reach.json),
        Err(_) => say_done(reach, answer).map(|()| Exit::Fine),
    }
}

pub(super) fn swaps(args: &Swaps) -> Result<Exit> {
    let client = client(&args.reach)?;
    match args.number {
        Some(number) if args.cancel => {
            let answer = client.post(&format!("/v1/swaps/{number}/cancel"), &json!({}))?;
            say_done(&args.reach, answer)?;
            Ok(Exit::Fine)
        }
        Some(number) => {
            let status = client.get(&format!("/v1/swaps/{number}"), &[])?;
            end(follow(&client, status, false, args.reach.json)?, args.reach.json)
        }
        None => {
            let answer: Value = client.get("/v1/swaps", &[])?;
            if args.reach.json {
                say_json(&answer)?;
            } else {
                report::say(&list(&serde_json::from_value::<Vec<SwapStatus>>(answer)?));
            }
            Ok(Exit::Fine)
        }
    }
}

fn list(swaps: &[SwapStatus]) -> String {
    if swaps.is_empty() {
        return "there was no swap since the plant's start\n".into();
    }
    let mut table = table(["number", "stage", "what", "by", "asked (UTC)", ""]);
    for swap in swaps {
        let what: Vec<_> =
            swap.blocks.iter().map(|b| format!("{}: {} → {}", b.block, b.old.component, b.new.component)).collect();
        let saved = if swap.saved { "saved" } else { "" };
        let last = if swap.message.is_empty() { saved } else { &swap.message };
        table.add_row([
            swap.number.to_string(),
            text::stage(swap.stage).into(),
            plain(&what.join(", ")),
            plain(&swap.user),
            time(swap.asked),
            plain(last),
        ]);
    }
    lines(&table)
}

fn end(end: End, json: bool) -> Result<Exit> {
    match end {
        End::Over(status) if json => {
            say_json(&serde_json::to_value(&status)?)?;
            Ok(exit(status.stage))
        }
        End::Over(status) => Ok(outcome(&status)),
        End::Left(number) => Ok(left(number)),
    }
}

fn exit(stage: Stage) -> Exit {
    if matches!(stage, Stage::Done | Stage::Planned) { Exit::Fine } else { Exit::Wanting }
}

/// Why it has not come to the end it was meant to.
fn outcome(status: &SwapStatus) -> Exit {
    let exit = exit(status.stage);
    if exit != Exit::Fine {
        let why = if status.message.is_empty() { String::new() } else { format!(": {}", plain(&status.message)) };
        report::error(&anyhow!("swap {} was {}{why}", status.number, text::stage(status.stage)));
    }
    exit
}

fn left(number: u64) -> Exit {
    report::say(&format!(
        "swap {number} goes on without this program; `latchwork swaps {number}` follows it, `latchwork swaps {number} --cancel` \
         calls it off before the exchange\n"
    ));
    Exit::Wanting
}

/// There is a person who reads and can answer.
fn can_ask() -> bool {
    std::io::stdin().is_terminal() && std::io::stdout().is_terminal()
}

fn agreed(question: &str) -> Result<bool> {
    report::say(&format!("{question} [y/N] "));
    let mut answer = String::new();
    std::io::stdin().lock().read_line(&mut answer)?;
    Ok(matches!(answer.trim().to_lowercase().as_str(), "y" | "yes"))
}

fn nobody_to_ask(what: &str) -> Exit {
    let only = if what == "swap" { ", or --dry-run to see only what would change" } else { "" };
    usage(&format!("nobody can be asked here whether to {what}"), &format!("add --yes to do it without asking{only}"))
}

fn usage(error: &str, help: &str) -> Exit {
    eprintln!("error: {error}\n  help: {help}");
    Exit::Usage
}

#[cfg(test)]
mod tests;
