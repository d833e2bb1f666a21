//! `latchwork watch`: values as they change; a table on a terminal, lines elsewhere.

use super::client::{client, plain, shown, table};
use crate::Exit;
use crate::args::operate::Watch;
use crate::report;
use crate::run::{Screen, cut};
use anyhow::{Context, Result};
use latchwork_api::client::{Client, Lines};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long a terminal waits for a change before it looks for Ctrl-C.
const TURN: Duration = Duration::from_millis(100);
/// How long something counts as just changed.
const FRESH: Duration = Duration::from_secs(1);

#[derive(Deserialize, Serialize)]
struct Row {
    time: String,
    tag: String,
    #[serde(rename = "type")]
    ty: String,
    value: Value,
    quality: String,
    forced: bool,
}

pub(super) fn execute(args: &Watch) -> Result<Exit> {
    let client = client(&args.reach)?;
    let mut query: Vec<_> = args.tags.iter().map(|tag| ("match", tag.as_str())).collect();
    query.push(("every", &args.every));
    let lines = client.lines("/v1/watch", &query)?;
    match std::io::stdout().is_terminal() && !args.reach.json {
        true => screen(&client, lines),
        false => print(lines, args.reach.json),
    }
}

fn print(mut lines: Lines<'_>, json: bool) -> Result<Exit> {
    loop {
        let Some(row) = lines.next::<Row>(Duration::from_secs(3600))? else { continue };
        if json {
            report::say(&format!("{}\n", serde_json::to_string(&row)?));
        } else {
            let mut line = format!("{}  {} = {}", row.time, plain(&row.tag), shown(&row.value));
            line += &notes(&row).map(|n| format!("  ({n})")).unwrap_or_default();
            report::say(&(line + "\n"));
        }
    }
}

/// What is remarkable about a value.
fn notes(row: &Row) -> Option<String> {
    let quality = (row.quality != "good").then(|| plain(&row.quality));
    let forced = row.forced.then(|| "forced".to_owned());
    let notes: Vec<_> = quality.into_iter().chain(forced).collect();
    (!notes.is_empty()).then(|| notes.join(", "))
}

fn screen(client: &Client, mut lines: Lines<'_>) -> Result<Exit> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM, signal_hook::consts::SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&stop)).context("the handler of Ctrl-C could not be set")?;
    }
    let plant = client.get::<Value>("/", &[])?;
    let title = format!("{}   Ctrl-C ends", shown(&plant["plant"]));
    // The screen is given back before an error is told: it is dropped first.
    let mut screen = Screen::open().context("the terminal could not be used")?;
    let mut rows: Vec<(Row, Instant)> = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        let mut wait = TURN;
        // All that has come so far is one picture.
        while let Some(row) = lines.next::<Row>(wait)? {
            wait = Duration::ZERO;
            match rows.iter_mut().find(|(r, _)| r.tag == row.tag) {
                Some(place) => *place = (row, Instant::now()),
                None => rows.push((row, Instant::now())),
            }
        }
        screen.draw(&picture(&title, &rows, Screen::size()))?;
    }
    Ok(Exit::Fine)
}

fn picture(title: &str, rows: &[(Row, Instant)], (columns, height): (u16, u16)) -> Vec<String> {
    let colours = report::colours();
    let mut table = table(["tag", "value", "type", "changed", ""]);
    let room = usize::from(height).saturating_sub(5);
    for (row, _) in rows.iter().take(room) {
        let time = row.time.get(11..23).unwrap_or(&row.time).to_owned();
        table.add_row([plain(&row.tag), shown(&row.value), plain(&row.ty), time, notes(row).unwrap_or_default()]);
    }
    let mut lines = vec![title.to_owned(), String::new()];
    // The header is the table's first line, then each row has one.
    for (n, line) in table.lines().enumerate() {
        let line = cut(&line, usize::from(columns));
        let row = n.checked_sub(1).and_then(|n| rows.get(n));
        let colour = match row {
            Some((row, _)) if notes(row).is_some() => "33",
            Some((_, at)) if at.elapsed() < FRESH => "1",
            _ => "",
        };
        lines.push(if colours && !colour.is_empty() { format!("\x1b[{colour}m{line}\x1b[0m") } else { line });
    }
    if rows.len() > room {
        lines.push(format!("… and {} more; name those you want", rows.len() - room));
    }
    lines
}
