//! All kinds of sinks, one line each.

pub mod jsonl;
mod jsonl_files;
pub mod mqtt;
mod mqtt_session;
pub mod syslog;

use crate::SinkKind;

/// The kinds a plant file may name.
pub static KINDS: &[&SinkKind] = &[&jsonl::JSONL, &mqtt::MQTT, &syslog::SYSLOG, &crate::COMPONENT];

/// The kind of a name.
pub fn find(name: &str) -> Option<&'static SinkKind> {
    KINDS.iter().copied().find(|k| k.name == name)
}
