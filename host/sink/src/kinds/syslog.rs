//! `syslog`: the system's log, through `/dev/log` or journald.
//!
//! ```toml
//! [sink.system]
//! kind = "syslog"
//! priority = 100
//! ```
//!
//! Neither of the two says what it has kept: a record counts as kept when it was taken from this program.

use crate::{Config, Problem, Sink, SinkKind};
use ::syslog::{Facility, Formatter3164, LogFormat, Severity};
use latchwork_image::Value;
use latchwork_record::{Record, rfc3339};
use latchwork_schema::{Key, Kind, Section};
use libsystemd::logging::{Priority, SD_JOURNAL_SOCK_PATH, journal_send};
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The kind.
pub static SYSLOG: SinkKind = SinkKind { name: "syslog", keys: &KEYS, check, claim: |_| None, open };

/// Where syslog listens.
const DEV_LOG: &str = "/dev/log";
/// Longest wait for a daemon that takes nothing.
const TIMEOUT: Duration = Duration::from_secs(2);

static KEYS: Section = Section {
    name: "[sink.NAME] (syslog)",
    doc: "The system's log: syslog's socket, or journald with the record in fields of their own.",
    keys: &[
        Key::optional(
            "target",
            Kind::OneOf(&["auto", "syslog", "journald"]),
            "\"auto\"",
            "journald where it runs, else syslog.",
        ),
        Key::optional("path", Kind::Text, "\"/dev/log\"", "Socket of syslog, where it is another one."),
    ],
};

fn check(config: &Config) -> Vec<Problem> {
    let mut problems = Vec::new();
    if config.values.has("path") && config.values.text("target") == Some("journald") {
        problems.push(Problem {
            key: "path".into(),
            message: "`path` is the socket of syslog, and the target is journald".into(),
            help: Some("take one of the two out".into()),
        });
    }
    problems
}

fn open(config: &Config) -> Result<Box<dyn Sink>, String> {
    let path = config.values.text("path");
    let journald = match config.values.text("target") {
        Some("journald") => true,
        Some("syslog") => false,
        _ => path.is_none() && Path::new(SD_JOURNAL_SOCK_PATH).exists(),
    };
    let plant = config.plant.clone();
    if journald {
        return Ok(Box::new(Journald { plant }));
    }
    let path = config.folder.join(path.unwrap_or(DEV_LOG));
    let formatter = Formatter3164 {
        facility: Facility::LOG_DAEMON,
        hostname: None,
        process: "latchwork".into(),
        pid: std::process::id(),
    };
    Ok(Box::new(Syslog { plant, path, formatter, socket: None }))
}

/// The severity of RFC 5424 that a record's priority stands for, 1 (alert) to 6 (informational).
fn severity(priority: u8) -> u8 {
    match priority {
        0..50 => 6,
        50..100 => 5,
        100..150 => 4,
        150..200 => 3,
        200..255 => 2,
        255 => 1,
    }
}

/// Most bytes of a message; what is beyond is cut off. Sockets refuse datagrams that are too long, again and again.
const LONGEST: usize = 32 << 10;

/// A text of so many bytes at most.
fn cut(mut text: String, most: usize) -> String {
    const ELLIPSIS: &str = "…";
    if text.len() > most {
        text.truncate(text.floor_char_boundary(most.saturating_sub(ELLIPSIS.len())));
        text += ELLIPSIS;
    }
    text
}

/// The record as a person reads it.
fn line(plant: &str, record: &Record) -> String {
    let mut line = format!("{plant}: {} {} {}", record.kind.name(), record.source, record.transition);
    if (&record.previous, &record.current) != (&Value::None, &Value::None) {
        line += &format!(" {} -> {}", record.previous, record.current);
    }
    if !record.user.is_empty() {
        line += &format!(" by {}", record.user);
    }
    if !record.text.is_empty() {
        line += &format!(": {}", record.text);
    }
    let end = format!(" [seq {}, {}]", record.seq, rfc3339(record.time));
    line = cut(line, LONGEST - end.len()) + &end;
    // One record is one line of the log.
    line.replace(|c: char| c.is_control(), " ")
}

struct Syslog {
    plant: String,
    path: PathBuf,
    formatter: Formatter3164,
    socket: Option<UnixDatagram>,
}

impl Syslog {
    fn connect(&mut self) -> std::io::Result<&UnixDatagram> {
        Ok(match &mut self.socket {
            Some(socket) => socket,
            closed => {
                let socket = UnixDatagram::unbound()?;
                socket.connect(&self.path)?;
                socket.set_write_timeout(Some(TIMEOUT))?;
                closed.insert(socket)
            }
        })
    }

    fn send(&mut self, record: &Record) -> std::io::Result<()> {
        let severity = match severity(record.priority) {
            1 => Severity::LOG_ALERT,
            2 => Severity::LOG_CRIT,
            3 => Severity::LOG_ERR,
            4 => Severity::LOG_WARNING,
            5 => Severity::LOG_NOTICE,
            _ => Severity::LOG_INFO,
        };
        let mut datagram = Vec::new();
        self.formatter
            .format(&mut datagram, severity, line(&self.plant, record))
            .map_err(|e| std::io::Error::other(e.to_string()))?;
        let sent = self.connect()?.send(&datagram);
        if sent.is_err() {
            // The daemon may have begun anew, with another socket of the same name.
            self.socket = None;
        }
        sent.map(drop)
    }
}

impl Sink for Syslog {
    fn write(&mut self, batch: &[Record]) -> Result<u64, String> {
        let path = self.path.display().to_string();
        all(batch, |record| self.send(record).map_err(|e| format!("{path} takes nothing: {e}")))
    }
}

struct Journald {
    plant: String,
}

impl Sink for Journald {
    fn write(&mut self, batch: &[Record]) -> Result<u64, String> {
        all(batch, |record| {
            let priority = match severity(record.priority) {
                1 => Priority::Alert,
                2 => Priority::Critical,
                3 => Priority::Error,
                4 => Priority::Warning,
                5 => Priority::Notice,
                _ => Priority::Info,
            };
            let fields = [
                ("SYSLOG_IDENTIFIER", "latchwork".to_owned()),
                ("LATCHWORK_PLANT", self.plant.clone()),
                ("LATCHWORK_SEQ", record.seq.to_string()),
                ("LATCHWORK_TIME", rfc3339(record.time)),
                ("LATCHWORK_KIND", record.kind.name().to_owned()),
                ("LATCHWORK_SOURCE", record.source.clone()),
                ("LATCHWORK_TRANSITION", record.transition.to_string()),
                ("LATCHWORK_PREVIOUS", record.previous.to_string()),
                ("LATCHWORK_CURRENT", record.current.to_string()),
                ("LATCHWORK_PRIORITY", record.priority.to_string()),
                ("LATCHWORK_USER", record.user.clone()),
            ];
            let message = line(&self.plant, record);
            journal_send(priority, &message, fields.into_iter()).map_err(|e| format!("journald takes nothing: {e}"))
        })
    }
}

/// Sends records one by one; the number of the last that was taken.
fn all(batch: &[Record], mut send: impl FnMut(&Record) -> Result<(), String>) -> Result<u64, String> {
    let mut kept = None;
    for record in batch {
        match (send(record), kept) {
            (Ok(()), _) => kept = Some(record.seq),
            (Err(why), None) => return Err(why),
            // The next try tells why.
            (Err(_), Some(seq)) => return Ok(seq),
        }
    }
    Ok(kept.unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn priorities_are_severities() {
        // docs/sinks.md has the same table.
        for (priorities, expected) in
            [(0..=49, 6), (50..=99, 5), (100..=149, 4), (150..=199, 3), (200..=254, 2), (255..=255, 1)]
        {
            assert!(priorities.clone().all(|p| severity(p) == expected), "{priorities:?}");
        }
    }
}
