//! Swaps in words.

use super::plain;
use latchwork_block::upgrade::{Change, Fate, Field, Part, PortChange};
use latchwork_image::format_duration;
use latchwork_plant::swap::{BlockPlan, Deviation, ShadowReport, Stage, SwapStatus, Version};

/// Digits of a hash that tell versions apart.
const HASH: usize = 12;
/// Width of the names of lines.
const WIDTH: usize = 10;

/// A stage, after "it was" or "it is".
pub(super) fn stage(stage: Stage) -> &'static str {
    match stage {
        Stage::Preparing => "being prepared",
        Stage::Shadow => "in the shadow",
        Stage::Exchanging => "being exchanged",
        Stage::Probation => "on probation",
        Stage::Done => "done",
        Stage::Planned => "planned",
        Stage::Refused => "refused",
        Stage::RolledBack => "rolled back",
        Stage::Cancelled => "cancelled",
    }
}

/// One line about where it is.
pub(super) fn progress(status: &SwapStatus) -> String {
    let number = status.number;
    match status.stage {
        Stage::Preparing => format!("swap {number}: preparing"),
        Stage::Shadow => {
            let done = status.shadow.iter().map(|s| s.executions).min().unwrap_or_default();
            let different: u64 = status.shadow.iter().map(|s| s.different).sum();
            format!("swap {number}: shadow {done}/{}, {different} different", done + status.left)
        }
        Stage::Exchanging if of_sink(status) => format!("swap {number}: waits for the end of a batch"),
        Stage::Exchanging => format!("swap {number}: waits for the end of a scan"),
        Stage::Probation if of_sink(status) => format!("swap {number}: on probation for {} batches", status.left),
        Stage::Probation => format!("swap {number}: on probation for {} executions", status.left),
        Stage::Done => {
            let now: Vec<_> = status.blocks.iter().map(|b| format!("{} runs {}", b.block, b.new.component)).collect();
            let saved = if status.saved { ", and the plant file says so" } else { "" };
            plain(&format!("swap {number}: done; {}{saved}", now.join(", ")))
        }
        Stage::Planned => format!("swap {number}: nothing was changed, this is what it would do"),
        Stage::Refused => format!("swap {number}: refused, nothing was changed"),
        Stage::RolledBack => format!("swap {number}: rolled back, the old version runs again with its state"),
        Stage::Cancelled => format!("swap {number}: cancelled, nothing was changed"),
    }
}

fn of_sink(status: &SwapStatus) -> bool {
    status.blocks.iter().any(|b| b.block.starts_with("sink."))
}

/// A span with the digits that matter.
pub(super) fn span(ns: u64) -> String {
    let scaled = |unit: f64, name: &str| format!("{:.1} {name}", ns as f64 / unit);
    match ns {
        0..1_000 => format!("{ns} ns"),
        1_000..1_000_000 => scaled(1e3, "µs"),
        1_000_000..1_000_000_000 => scaled(1e6, "ms"),
        _ => scaled(1e9, "s"),
    }
}

/// A moment of plant time, to the microsecond.
pub(super) fn moment(ns: u64) -> String {
    format_duration(ns / 1_000 * 1_000)
}

/// What a swap would change in a block.
pub(super) fn plan(plan: &BlockPlan) -> String {
    let BlockPlan { block, old, new, .. } = plan;
    let mut out = plain(&format!("{block}: {} becomes {}", old.component, new.component)) + "\n";
    let mut list = |name: &str, lines: Vec<String>| {
        for (at, line) in lines.iter().enumerate() {
            let name = if at == 0 { name } else { "" };
            out += format!("  {name:WIDTH$}{}", plain(line)).trim_end();
            out.push('\n');
        }
    };
    list("hash", vec![versus(short(old), short(new))]);
    list("size", vec![versus(format!("{} bytes", old.size), format!("{} bytes", new.size))]);
    list("class", vec![versus(old.class.clone(), new.class.clone())]);
    list("call path", vec![versus(old.path.clone(), new.path.clone())]);
    list("imports", vec![versus(imports(old), imports(new))]);
    list("ports", or_same(plan.ports.iter().filter(|p| shown(p)).map(port).collect()));
    list("state", fields(&plan.state, "none"));
    list("settings", fields(&plan.settings, "none"));
    list("BREAKS", plan.broken.clone());
    list("note", plan.notes.clone());
    out
}

/// State and settings have lines of their own.
fn shown(change: &PortChange) -> bool {
    !matches!(change.part, Part::Retained | Part::Settings)
}

fn short(version: &Version) -> String {
    version.hash.get(..HASH).unwrap_or(&version.hash).to_owned()
}

fn imports(version: &Version) -> String {
    if version.imports.is_empty() { "none".into() } else { version.imports.join(", ") }
}

fn versus(old: String, new: String) -> String {
    if old == new { old } else { format!("{old} → {new}") }
}

fn or_same(lines: Vec<String>) -> Vec<String> {
    if lines.is_empty() { vec!["the same".into()] } else { lines }
}

fn port(change: &PortChange) -> String {
    let part = match change.part {
        Part::Inputs => "inputs",
        Part::Outputs => "outputs",
        Part::Settings => "settings",
        Part::Retained => "retained",
        Part::Commands => "commands",
        Part::Alarms => "alarms",
    };
    let name = format!("{part}.{}", change.name);
    match &change.change {
        Change::Added { ty } => format!("+ {name}: {ty}"),
        Change::Gone { ty } => format!("- {name}: {ty}"),
        Change::Type { from, to } => format!("~ {name}: {from} → {to}"),
    }
}

/// Those that are carried as they are in one line, each of the others in its own.
fn fields(fields: &[Field], none: &str) -> Vec<String> {
    let carried: Vec<_> = fields.iter().filter(|f| f.fate == Fate::Carried).map(|f| f.name.as_str()).collect();
    let mut lines = Vec::new();
    if !carried.is_empty() {
        lines.push(format!("= {}", carried.join(", ")));
    }
    lines.extend(fields.iter().filter_map(|f| {
        let name = &f.name;
        Some(match &f.fate {
            Fate::Carried => return None,
            Fate::Converted { from, to } => format!("~ {name}: {from} → {to}, keeps its value"),
            Fate::Lossy { from, to, allowed: true } => format!("! {name}: {from} → {to}, clamped if it does not fit"),
            Fate::Lossy { from, to, allowed: false } => {
                format!("! {name}: {from} → {to} may not fit; --allow-lossy clamps it")
            }
            Fate::New => format!("+ {name}: {}, new", f.ty),
            Fate::Dropped => format!("- {name}: {}, dropped", f.ty),
        })
    }));
    if lines.is_empty() { vec![none.into()] } else { lines }
}

/// What the shadow of a block has seen.
pub(super) fn shadow(report: &ShadowReport) -> String {
    let ShadowReport { block, executions, different, missed, .. } = report;
    let missed = if *missed == 0 { String::new() } else { format!(", {missed} not compared for want of room") };
    let mut out = plain(&format!("shadow of {block}: {executions} executions, {different} different{missed}")) + "\n";
    let time = |name: &str, mean, max| format!("  {name:WIDTH$}{} mean, {} longest\n", span(mean), span(max));
    out += &time("running", report.running_mean_ns, report.running_max_ns);
    out += &time("new", report.candidate_mean_ns, report.candidate_max_ns);
    report.deviations.iter().for_each(|d| out += &deviation(d));
    if let Some(fault) = &report.fault {
        out += &plain(&format!("  {} at {}: {}", fault.kind, moment(fault.at), fault.message));
        out += &format!("\n{}", with(&fault.inputs));
    }
    out
}

fn deviation(d: &Deviation) -> String {
    // Only numbers have a worst one.
    let worst =
        if d.worst > 0.0 { format!("; worst by {}, at {}", d.worst, moment(d.worst_at)) } else { String::new() };
    let times = if d.count == 1 { "once".into() } else { format!("{} times", d.count) };
    let line = format!("  {}: {times}, first at {}{worst}: {} → {}", d.port, moment(d.first), d.running, d.candidate);
    format!("{}\n{}", plain(&line), with(&d.inputs))
}

fn with(inputs: &[(String, String)]) -> String {
    let list: Vec<_> = inputs.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    if list.is_empty() { String::new() } else { plain(&format!("    with {}", list.join(", "))) + "\n" }
}
