//! Hot swap: another version of a block under a running plant. One test per rule.

mod edges;
mod exchange;
mod operators;
mod probation;
mod refused;
mod rollback;
mod running;
mod settings;
mod shadow;
mod time;

use latchwork_record::Kind;
use latchwork_tests_plant::forge::Counter;
use latchwork_tests_plant::{Ran, Rig};

pub(crate) const MS: u64 = 1_000_000;
pub(crate) const S: u64 = 1_000 * MS;

/// A counter, what shows its count, and a second counter behind it; `more` are further keys of the first one's table.
pub(crate) fn plant_with(first: &Counter, more: &str) -> Rig {
    Rig::new(&format!(
        r#"
        [lane.main]
        every = "10ms"
        [driver.field]
        kind = "sim"
        [driver.field.points]
        hold = {{ type = "bool" }}
        shown = {{ type = "u32", from = "count.outputs.count" }}
        [block.count]
        component = "v1.wasm"
        lane = "main"
        inputs.hold = "field.hold"
        {more}
        [block.other]
        component = "other.wasm"
        lane = "main"
        "#
    ))
    .with("v1", &first.component())
    .with("other", &Counter::new(1).component())
}

pub(crate) fn plant() -> Rig {
    plant_with(&Counter::new(1), "")
}

/// Records of swaps and faults as `time-in-ms source transition`.
pub(crate) fn told(ran: &Ran) -> Vec<String> {
    let of_kind = ran.records.iter().filter(|r| matches!(r.kind, Kind::Swap | Kind::Fault));
    of_kind.map(|r| format!("{} {} {}", r.time / MS, r.source, r.transition)).collect()
}

/// The text of the one record of a block with this transition.
pub(crate) fn text<'a>(ran: &'a Ran, source: &str, transition: &str) -> &'a str {
    let mut found = ran.records.iter().filter(|r| r.source == source && r.transition == transition);
    let first = found.next().unwrap_or_else(|| panic!("no {transition} of {source}: {:#?}", told(ran)));
    assert!(found.next().is_none(), "more than one {transition} of {source}");
    &first.text
}

/// No scan was missed, no lane stopped, and the count went up by one in each scan: nothing was lost and nothing repeated.
pub(crate) fn undisturbed(ran: &Ran, scans: u64) {
    let lane = &ran.outcome.lanes[0];
    assert_eq!((lane.statistics.scans, lane.statistics.overruns), (scans, 0));
    assert!(!ran.outcome.faulted(), "{:#?}", ran.records);
    counts(ran, "count", scans);
    counts(ran, "other", scans);
}

/// A counter that has counted each scan.
pub(crate) fn counts(ran: &Ran, block: &str, scans: u64) {
    let counts = ran.history(&format!("{block}.outputs.count"));
    let expected: Vec<_> = (0..scans).map(|n| (n * 10 * MS, (n + 1).to_string())).collect();
    let counts: Vec<_> = counts.into_iter().map(|(time, count)| (time, count.to_string())).collect();
    assert_eq!(counts, expected, "{block}");
}
