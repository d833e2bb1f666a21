//! Sections as the reference page shows them.

use crate::words::{expected, format_size};
use crate::{Key, Kind, Section};
use latchwork_image::format_duration;
use std::fmt::Write;

/// A section as Markdown: its sentence and a table of its keys.
pub fn reference(section: &Section) -> String {
    let mut out = format!("{}\n", section.doc);
    if section.keys.is_empty() {
        return out;
    }
    out += "\n| key | value | default | |\n|---|---|---|---|\n";
    for key in section.keys {
        // Writing to a String never fails.
        let _ =
            writeln!(out, "| `{}` | {} | {} | {} |", key.name, cell(&value(&key.kind)), default(key), cell(key.doc));
    }
    out
}

fn default(key: &Key) -> String {
    match (key.required, key.default) {
        (true, _) => "required".into(),
        (false, "") => "–".into(),
        (false, default) => format!("`{default}`"),
    }
}

fn value(kind: &Kind) -> String {
    match kind {
        Kind::Duration { min, max } => format!("duration, {} to {}", format_duration(*min), format_duration(*max)),
        Kind::Size { min, max } => format!("size, {} to {}", format_size(*min), format_size(*max)),
        other => expected(other),
    }
}

/// Text that may stand in a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}
