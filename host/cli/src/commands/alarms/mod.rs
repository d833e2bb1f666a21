//! `latchwork alarms …`

mod codes;
mod list;
mod report;

pub(super) use list::{acknowledge, change, shelve};

use crate::Exit;
use crate::args::AlarmsCommand;
use crate::args::operate::Alarms;
use anyhow::{Context, Result};
use latchwork_block::Engine;
use std::borrow::Cow;
use std::fs::File;
use std::io::Write;
use std::path::Path;

pub(super) fn execute(engine: impl FnOnce() -> Result<Engine>, args: &Alarms) -> Result<Exit> {
    match &args.command {
        None => list::execute(args),
        Some(AlarmsCommand::Report(args)) => report::execute(args),
        Some(AlarmsCommand::Codes(args)) => codes::execute(&engine()?, args),
    }
}

/// Writes a text into a file, or to the output.
fn deliver(text: &str, output: Option<&Path>) -> Result<()> {
    let Some(path) = output else {
        crate::report::say(text);
        return Ok(());
    };
    let write = || {
        let mut file = File::create(path)?;
        file.write_all(text.as_bytes())?;
        // A stick may be drawn as soon as this program has ended.
        file.sync_all()
    };
    write().with_context(|| format!("{} could not be written", path.display()))
}

/// A text that may stand in XML: names and texts come from files, and most control characters may not, however they are written.
pub(super) fn printable(text: &str) -> Cow<'_, str> {
    let refused = |c: char| (c.is_control() && c != '\n' && c != '\t') || matches!(c, '\u{fffe}' | '\u{ffff}');
    if text.contains(refused) { text.replace(refused, "\u{fffd}").into() } else { text.into() }
}
