//! A logger that counts alarms, per source and transition, and forwards them as JSON lines:
//!
//! ```toml
//! [sink.pager]
//! kind = "component"
//! component = "alarm-counter"
//! directory = "counts"                  # `counts.json` is in it
//! connect = ["192.168.1.9:5140"]        # the first one gets the alarms; none: they are only counted
//! config = { to = "192.168.1.9:5140" }  # another one of `connect`
//! ```
//!
//! Counts are exact whatever is killed when: the number of the last record that was counted stands with them. A forwarded
//! record may come twice (the connection broke after it arrived), never not at all. The other side must read to the end and close:
//! one that keeps the connection open gets the same alarms again when `budget` is over. The number is of one journal: with another
//! it is forgotten, and the counts go on.

mod counts;
mod forward;

use counts::Counts;
use exports::latchwork::journal::sink::Guest;
use forward::Line;
use latchwork::journal::types::{Entry, Kind, Value};
use serde::Deserialize;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

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

struct State {
    counts: Counts,
    to: Option<SocketAddr>,
}

/// The instance has one thread; the lock never waits.
static STATE: Mutex<Option<State>> = Mutex::new(None);

struct AlarmCounter;

impl Guest for AlarmCounter {
    fn open(config: String) -> Result<(), String> {
        let (to, journal) = destination(&config)?;
        let counts = Counts::open(Path::new(DIRECTORY), &journal)?;
        *STATE.lock().unwrap_or_else(PoisonError::into_inner) = Some(State { counts, to });
        Ok(())
    }

    fn write(batch: Vec<Entry>) -> Result<u64, String> {
        let mut state = STATE.lock().unwrap_or_else(PoisonError::into_inner);
        let State { counts, to } = state.as_mut().ok_or("`write` came before `open`")?;
        let last = batch.last().map_or(0, |entry| entry.seq);
        let alarms: Vec<Entry> = batch.into_iter().filter(|e| e.kind == Kind::Alarm && e.seq > counts.seq()).collect();
        if let (Some(to), false) = (*to, alarms.is_empty()) {
            let lines: Vec<Line<'_>> = alarms.iter().map(line).collect();
            forward::send(to, &lines)?;
        }
        // After they were sent: what fails here is sent again rather than never.
        counts.add(alarms.iter().map(|e| (e.seq, &*e.source, &*e.transition)))?;
        Ok(last)
    }
}

// The names of the exports are none that a native linker takes.
#[cfg(target_arch = "wasm32")]
generated::export!(AlarmCounter with_types_in generated);

#[derive(Deserialize)]
struct Table {
    #[serde(default)]
    connect: Vec<SocketAddr>,
    #[serde(default)]
    config: Own,
    #[serde(default)]
    journal: String,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Own {
    to: Option<SocketAddr>,
}

/// Where alarms go, if anywhere, and the identity of the journal.
fn destination(config: &str) -> Result<(Option<SocketAddr>, String), String> {
    let table: Table =
        serde_json::from_str(config).map_err(|e| format!("the plant file's table does not suit alarm-counter: {e}"))?;
    match table.config.to {
        Some(to) if !table.connect.contains(&to) => {
            Err(format!("`config` names {to}, which `connect` does not grant; add it there"))
        }
        to => Ok((to.or(table.connect.first().copied()), table.journal)),
    }
}

fn line(entry: &Entry) -> Line<'_> {
    Line {
        seq: entry.seq,
        time: forward::time(entry.time),
        kind: "alarm",
        source: &entry.source,
        transition: &entry.transition,
        previous: value(&entry.previous),
        current: value(&entry.current),
        priority: entry.priority,
        user: &entry.user,
        text: &entry.text,
    }
}

fn value(value: &Value) -> serde_json::Value {
    match value {
        Value::None => serde_json::Value::Null,
        Value::Boolean(b) => (*b).into(),
        Value::Integer(i) => (*i).into(),
        // JSON has no NaN and no infinities: they are carried as text.
        Value::Real(r) if !r.is_finite() => format!("{r:?}").into(),
        Value::Real(r) => (*r).into(),
        Value::Text(text) => text.as_str().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::destination;

    #[test]
    fn alarms_go_to_the_first_address_or_to_the_one_that_is_named() {
        let to = |config: &str| destination(config).map(|(a, _)| a.map(|a| a.to_string()));
        assert_eq!(to(r#"{"kind": "component"}"#), Ok(None));
        assert_eq!(to(r#"{"connect": ["127.0.0.1:1", "[::1]:2"]}"#), Ok(Some("127.0.0.1:1".into())));
        assert_eq!(
            to(r#"{"connect": ["127.0.0.1:1", "[::1]:2"], "config": {"to": "[::1]:2"}}"#),
            Ok(Some("[::1]:2".into()))
        );
        assert!(
            to(r#"{"connect": [], "config": {"to": "[::1]:2"}}"#).unwrap_err().contains("`connect` does not grant")
        );
        assert!(to(r#"{"config": {"too": "[::1]:2"}}"#).unwrap_err().contains("unknown field `too`"));
    }
}
