//! Lanes: their defaults, and that each has something to do.

use super::Draft;
use crate::file::{LaneEntry, PlantFile};
use crate::model;
use latchwork_image::format_duration;
use latchwork_schema::{Checker, Finding};
use std::path::PathBuf;

/// Watchdog of an interrupt lane that names none, ns.
const INTERRUPT_WATCHDOG: u64 = 50_000_000;
/// Timeout of a hardware watchdog that names none, ns.
const WATCHDOG_TIMEOUT: u64 = 10_000_000_000;

/// A lane of the model; its place in the list is that in the file.
pub(super) struct LaneDraft {
    pub(super) lane: model::Lane,
}

pub(super) fn lanes(checker: &mut Checker, file: &PlantFile) -> Vec<LaneDraft> {
    file.lanes.iter().map(|entry| LaneDraft { lane: lane(checker, entry) }).collect()
}

/// The hardware watchdog: device, and timeout in ns.
pub(super) fn watchdog(checker: &mut Checker, file: &PlantFile, lanes: &[LaneDraft]) -> Option<(PathBuf, u64)> {
    let device = file.plant.text("watchdog-device")?;
    let timeout = file.plant.duration("watchdog-timeout").unwrap_or(WATCHDOG_TIMEOUT);
    let span = file.plant.span_of("watchdog-device");
    // A lane that was refused may be the one that pets.
    match lanes.iter().find(|l| l.lane.interrupt.is_none()) {
        None if file.refused_lanes.is_empty() => {
            let finding = Finding::error(&span, "nobody would pet the watchdog: the plant has no cyclic lane");
            checker.add(finding.help("add a lane with `every`; the first one pets it"));
        }
        Some(LaneDraft { lane }) if lane.every.saturating_mul(2) > timeout => {
            let message = format!(
                "lane `{}` would pet the watchdog every {}, and it resets the machine after {}",
                lane.name,
                format_duration(lane.every),
                format_duration(timeout)
            );
            let help = "give `watchdog-timeout` at least twice the period, or put a faster cyclic lane first";
            checker.add(Finding::error(&span, message).help(help));
        }
        _ => {}
    }
    Some((PathBuf::from(device), timeout))
}

fn lane(checker: &mut Checker, entry: &LaneEntry) -> model::Lane {
    let values = &entry.values;
    let every = match entry.interrupt {
        true => values.duration("poll").unwrap_or(0),
        // A lane whose period is wrong is checked on with one that is usual.
        false => values.duration("every").unwrap_or(10_000_000),
    };
    let default = if entry.interrupt { INTERRUPT_WATCHDOG.max(every) } else { every.saturating_mul(5) };
    let watchdog = values.duration("watchdog").unwrap_or(default);
    if watchdog < every {
        let (watchdog, every) = (format_duration(watchdog), format_duration(every));
        let message = format!("`watchdog` is {watchdog}, shorter than the period of {every}");
        let finding = Finding::error(&values.span_of("watchdog"), message);
        checker.add(finding.help("a scan longer than the period is an overrun already; the watchdog stops the lane"));
    }
    let whole = |key: &str, default: u64| values.integer(key).and_then(|i| u64::try_from(i).ok()).unwrap_or(default);
    let interrupt = entry.interrupt.then(|| model::Interrupt {
        on: Vec::new(),
        poll: values.has("poll"),
        also_with: None,
        storm_limit: whole("storm-limit", 10_000),
        queue: whole("queue", 1024) as usize,
    });
    model::Lane {
        name: entry.name.clone(),
        every,
        priority: values.integer("priority").and_then(|p| u8::try_from(p).ok()).unwrap_or(if entry.interrupt {
            45
        } else {
            40
        }),
        interrupt,
        served: Vec::new(),
        scan_times: Vec::new(),
        watchdog,
        cpu: values.integer("cpu").and_then(|c| usize::try_from(c).ok()),
    }
}

/// False when the plant has no lane at all, not even one that was refused or could not be read.
pub(super) fn has_any(file: &PlantFile) -> bool {
    !(file.lanes.is_empty() && file.refused_lanes.is_empty() && !file.unread.contains(&"lane"))
}

/// Every lane has a block, every block a lane that exists, and there is a lane at all.
pub(super) fn have_blocks(checker: &mut Checker, file: &PlantFile, drafts: &[Draft<'_>]) {
    if !has_any(file) {
        let finding = Finding::error(&file.plant.span, "the plant has no lane");
        let wanted = file.blocks.iter().find_map(|b| b.values.text("lane")).unwrap_or("main");
        checker.add(finding.help(format!("add `[lane.{wanted}]` with `every = \"10ms\"`")));
    }
    for lane in &file.lanes {
        if drafts.iter().any(|d| d.entry.values.text("lane") == Some(&lane.name)) {
            continue;
        }
        let finding = Finding::error(&lane.key, format!("lane `{}` has no block", lane.name));
        let of_sim = file.blocks.iter().any(|b| b.sim && b.values.text("lane") == Some(&lane.name));
        checker.add(if of_sim {
            finding.help("its blocks stand in [sim], which counts only with --sim")
        } else {
            finding.help(format!("add a block with `lane = \"{}\"`, or take the lane out", lane.name))
        });
    }
}
