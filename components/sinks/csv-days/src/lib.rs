//! A logger that keeps one CSV file per day (UTC) in the directory that the plant file grants:
//!
//! ```toml
//! [sink.office]
//! kind = "component"
//! component = "csv-days"
//! directory = "logs"
//! ```
//!
//! `2026-11-27.csv` begins with a header; each record is in the file of its own day, quoted as RFC 4180 has it; a text that
//! a spreadsheet would take for a formula has a `'` before it. Whatever is killed
//! when, each record is there exactly once: a new instance finds its place again in its own files.

mod days;
mod table;
mod whose;

use days::Days;
use exports::latchwork::journal::sink::Guest;
use latchwork::journal::types::{Entry, Kind, Value};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use table::{Row, harmless};

// What the macro writes has no comments; the WIT has them.
#[allow(
    missing_docs,
    unreachable_pub,
    clippy::all,
    clippy::undocumented_unsafe_blocks,
    reason = "generated from wit/journal"
)]
mod generated {
    wit_bindgen::generate!({ path: "../../../wit/journal", world: "logger" });
}
use generated::{exports, latchwork};

/// Where the directory is that the plant file grants.
const DIRECTORY: &str = "/data";

/// The instance has one thread; the lock never waits.
static DAYS: Mutex<Option<Days>> = Mutex::new(None);

struct CsvDays;

impl Guest for CsvDays {
    fn open(config: String) -> Result<(), String> {
        let journal = nothing_asked(&config)?;
        let days = Days::open(PathBuf::from(DIRECTORY), &journal)?;
        *DAYS.lock().unwrap_or_else(PoisonError::into_inner) = Some(days);
        Ok(())
    }

    fn write(batch: Vec<Entry>) -> Result<u64, String> {
        let rows: Vec<Row> = batch.into_iter().map(row).collect();
        let mut days = DAYS.lock().unwrap_or_else(PoisonError::into_inner);
        let days = days.as_mut().ok_or("`write` came before `open`")?;
        days.write(&rows)
    }
}

// The names of the exports are none that a native linker takes.
#[cfg(target_arch = "wasm32")]
generated::export!(CsvDays with_types_in generated);

/// A slip in `config` is told rather than passed over: this logger asks for nothing. The identity of the journal.
fn nothing_asked(config: &str) -> Result<String, String> {
    let config: serde_json::Value =
        serde_json::from_str(config).map_err(|e| format!("the configuration is no JSON: {e}"))?;
    match config["config"].as_object().and_then(|c| c.keys().next()) {
        Some(key) => Err(format!("`config` has a key `{key}`; csv-days takes none: remove it")),
        None => Ok(config["journal"].as_str().unwrap_or_default().to_owned()),
    }
}

fn row(entry: Entry) -> Row {
    Row {
        seq: entry.seq,
        time: entry.time,
        kind: kind(entry.kind),
        source: harmless(entry.source),
        transition: harmless(entry.transition),
        previous: value(entry.previous),
        current: value(entry.current),
        priority: entry.priority,
        user: harmless(entry.user),
        text: harmless(entry.text),
    }
}

fn value(value: Value) -> String {
    match value {
        Value::None => String::new(),
        Value::Boolean(b) => b.to_string(),
        Value::Integer(i) => i.to_string(),
        Value::Real(r) => format!("{r:?}"),
        Value::Text(text) => harmless(text),
    }
}

fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Alarm => "alarm",
        Kind::Command => "command",
        Kind::Setting => "setting",
        Kind::Event => "event",
        Kind::Message => "message",
        Kind::Io => "io",
        Kind::Lane => "lane",
        Kind::Fault => "fault",
        Kind::Swap => "swap",
        Kind::Audit => "audit",
        Kind::Heartbeat => "heartbeat",
        Kind::Lost => "lost",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_is_a_formula_and_numbers_stay_numbers() {
        let entry = Entry {
            seq: 1,
            time: 0,
            kind: Kind::Setting,
            source: "-unit".into(),
            transition: "written".into(),
            previous: Value::Integer(-7),
            current: Value::Text("=HYPERLINK(\"http://x\")".into()),
            priority: 0,
            user: "@anna".into(),
            text: "a = b".into(),
        };
        let row = row(entry);
        assert_eq!((&*row.source, &*row.previous, &*row.user, &*row.text), ("'-unit", "-7", "'@anna", "a = b"));
        assert_eq!(row.current, "'=HYPERLINK(\"http://x\")");
        assert_eq!(value(Value::Real(-0.5)), "-0.5");
    }
}
