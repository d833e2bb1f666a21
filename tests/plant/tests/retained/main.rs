//! Retained state over restarts, at virtual time: what is saved when, what it costs, what the next run makes of it.

mod restart;
mod saving;
mod swap;
mod trouble;

use latchwork_retain::{Found, Retained, Saved, Version};
use latchwork_tests_plant::{Ran, Rig};
use std::sync::Arc;

const MS: u64 = 1_000_000;
const S: u64 = 1_000 * MS;

/// Three counters that count every scan, and one whose state is not retained.
const PLANT: &str = r#"
[retain]
every = "1s"
[lane.main]
every = "10ms"
[driver.field]
kind = "sim"
points.trap = { type = "bool" }
points.stand = { type = "bool" }
[block.a]
component = "keeper-probe"
lane = "main"
retain = true
inputs = { count = { tag = "field.stand", not = true }, trap = "field.trap" }
[block.b]
component = "keeper-probe"
lane = "main"
retain = true
inputs.count = { tag = "field.stand", not = true }
[block.c]
component = "keeper-probe"
lane = "main"
retain = true
inputs.count = { tag = "field.stand", not = true }
[block.not-kept]
component = "keeper-probe"
lane = "main"
inputs.count = { tag = "field.stand", not = true }
"#;

fn plant() -> Rig {
    Rig::new(PLANT)
}

/// The count that is kept of a block.
fn count(states: &Retained, block: &str) -> u64 {
    states.blocks[block].cells[0]
}

/// All records about retained state and blocks, as `source transition`.
fn told(ran: &Ran) -> Vec<String> {
    let about = |r: &&latchwork_record::Record| !r.source.starts_with("lane.");
    ran.records.iter().filter(about).map(|r| format!("{} {}", r.source, r.transition)).collect()
}

/// The text of the first record of a source with a transition.
fn text<'a>(ran: &'a Ran, source: &str, transition: &str) -> &'a str {
    let record = ran.records.iter().find(|r| r.source == source && r.transition == transition);
    &record.unwrap_or_else(|| panic!("no record {source} {transition}: {:?}", told(ran))).text
}

/// A state of block `a` alone, made by hand.
fn state(class: &str, schema: &str, cells: &[u64]) -> Found {
    let text = |s: &str| s.to_owned();
    let version = Version { class: text(class), component: text("old"), hash: text("00"), schema: text(schema) };
    let saved = Saved { version: Arc::new(version), time: 5, wall: 5, cells: cells.into() };
    Found::of(Retained { blocks: [(text("a"), Arc::new(saved))].into() })
}
