//! What a run comes to, for a person and for a script.

use super::Written;
use comfy_table::{Table, presets};
use latchwork_image::format_duration;
use latchwork_plant::lane::BlockState;
use latchwork_plant::run::Outcome;
use serde_json::{Value, json};
use std::fmt::Write;

fn state(state: BlockState) -> &'static str {
    match state {
        BlockState::Running => "running again",
        BlockState::Faulted => "waiting for its restart",
        BlockState::Parked => "parked",
    }
}

/// A few lines.
pub(crate) fn text(name: &str, outcome: &Outcome, written: &Written) -> String {
    let mut out = format!("\n{name}: {} of plant time\n", format_duration(outcome.time / 1_000_000 * 1_000_000));
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["lane", "state", "scans", "overruns", "mean scan", "longest", "latest start", "faults"]);
    for lane in &outcome.lanes {
        let s = &lane.statistics;
        let time = |ns: u64| format_duration(ns / 100 * 100);
        table.add_row([
            lane.name.clone(),
            lane.state.name().into(),
            s.scans.to_string(),
            s.overruns.to_string(),
            time(s.scan_time_mean()),
            time(s.scan_time_max),
            time(s.jitter_max),
            s.faults.to_string(),
        ]);
    }
    // Writing to a String never fails.
    let _ = writeln!(out, "{table}");
    for block in &outcome.faulted {
        let _ = writeln!(out, "block {}: {} faults, {}", block.name, block.faults, state(block.state));
    }
    let kinds: Vec<_> = written.by_kind.iter().map(|(k, n)| format!("{n} {}", k.name())).collect();
    let kinds = if kinds.is_empty() { String::new() } else { format!(" ({})", kinds.join(", ")) };
    let _ = writeln!(out, "{} records{kinds}", outcome.records);
    if let Some(retained) = &written.retained {
        let _ = writeln!(out, "{}", retained.text());
    }
    if written.rows > 0 {
        let _ = writeln!(out, "{} trace rows", written.rows);
    }
    if outcome.trace_lost > 0 {
        let _ = writeln!(out, "{} trace rows were lost: the disk was too slow; trace fewer tags", outcome.trace_lost);
    }
    out
}

/// The same for scripts.
pub(crate) fn json(name: &str, outcome: &Outcome, written: &Written) -> Value {
    let lanes: Vec<_> = outcome
        .lanes
        .iter()
        .map(|lane| {
            let s = &lane.statistics;
            json!({
                "name": lane.name,
                "state": lane.state.name(),
                "scans": s.scans,
                "overruns": s.overruns,
                "scan-time-mean-ns": s.scan_time_mean(),
                "scan-time-max-ns": s.scan_time_max,
                "jitter-max-ns": s.jitter_max,
                "faults": s.faults,
            })
        })
        .collect();
    let blocks: Vec<_> = outcome
        .faulted
        .iter()
        .map(|b| {
            let state = match b.state {
                BlockState::Running => "running",
                BlockState::Faulted => "faulted",
                BlockState::Parked => "parked",
            };
            json!({ "name": b.name, "state": state, "faults": b.faults })
        })
        .collect();
    json!({
        "plant": name,
        "time-ns": outcome.time,
        "faulted": outcome.faulted(),
        "lanes": lanes,
        "blocks-that-faulted": blocks,
        "records": outcome.records,
        "records-by-kind": written.by_kind.iter().map(|(k, n)| (k.name().to_string(), json!(n))).collect::<serde_json::Map<_, _>>(),
        "retained": written.retained.as_ref().map(super::retained::Written::json),
        "trace-rows": written.rows,
        "trace-rows-lost": outcome.trace_lost,
    })
}
