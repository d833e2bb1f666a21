//! What a person reads of swaps that are as they are here.

use super::follow::Teller;
use super::{list, text};
use latchwork_block::upgrade::{Change, Fate, Field, Part, PortChange};
use latchwork_plant::swap::{BlockPlan, Deviation, FailedRun, ShadowReport, Stage, SwapStatus, Version};

fn version(name: &str, digit: &str) -> Version {
    Version {
        component: name.into(),
        hash: digit.repeat(64),
        size: 20_480,
        class: "acme:tanks/tank@1.0.0".into(),
        imports: Vec::new(),
        path: "plain".into(),
    }
}

fn field(name: &str, ty: &str, fate: Fate) -> Field {
    Field { name: name.into(), ty: ty.into(), fate }
}

fn port(part: Part, name: &str, change: Change) -> PortChange {
    PortChange { part, name: name.into(), change }
}

/// The same class, other code.
fn small() -> BlockPlan {
    BlockPlan {
        block: "tank".into(),
        old: version("tank", "a"),
        new: version("tank-2", "b"),
        ports: Vec::new(),
        state: vec![field("starts", "u32", Fate::Carried), field("hours", "f64", Fate::Carried)],
        settings: Vec::new(),
        broken: Vec::new(),
        notes: Vec::new(),
    }
}

/// Everything that can change.
fn large() -> BlockPlan {
    let (from, to) = ("u32".to_owned(), "u64".to_owned());
    BlockPlan {
        block: "zone-b.turbo".into(),
        old: version("turbo", "a"),
        new: Version {
            size: 1_234_567,
            imports: vec!["latchwork:block/log@0.1.0".into()],
            path: "component".into(),
            ..version("turbo-py", "b")
        },
        ports: vec![
            port(Part::Inputs, "gain", Change::Added { ty: "f64".into() }),
            port(Part::Outputs, "old", Change::Gone { ty: "bool".into() }),
            port(Part::Outputs, "level", Change::Type { from: "f32".into(), to: "f64".into() }),
            port(Part::Commands, "purge", Change::Added { ty: "bool".into() }),
            port(Part::Retained, "starts", Change::Type { from: from.clone(), to: to.clone() }),
        ],
        state: vec![
            field("hours", "f64", Fate::Carried),
            field("starts", "u64", Fate::Converted { from: from.clone(), to: to.clone() }),
            field("small", "u32", Fate::Lossy { from: to.clone(), to: from.clone(), allowed: false }),
            field("smaller", "u32", Fate::Lossy { from: to, to: from, allowed: true }),
            field("filter", "f64", Fate::New),
            field("gone", "bool", Fate::Dropped),
        ],
        settings: vec![field("pulse", "duration", Fate::Carried), field("gain", "f64", Fate::New)],
        broken: vec!["gpio.lamp shows zone-b.turbo.outputs.old, which is gone".into()],
        notes: vec!["zone-b.turbo.inputs.gain has no tag until the plant file names it".into()],
    }
}

fn report(different: u64) -> ShadowReport {
    ShadowReport {
        block: "tank".into(),
        executions: 1000,
        different,
        running_mean_ns: 812,
        running_max_ns: 4_210,
        candidate_mean_ns: 1_034,
        candidate_max_ns: 5_120_000,
        ..ShadowReport::default()
    }
}

fn status(stage: Stage) -> SwapStatus {
    SwapStatus {
        number: 3,
        stage,
        message: String::new(),
        user: "alice".into(),
        asked: 1_795_737_600_000_000_000,
        blocks: vec![small()],
        left: 0,
        shadow: Vec::new(),
        prepare_ns: 212_345_678,
        exchange_ns: 0,
        exchanged_at: 0,
        saved: false,
    }
}

#[test]
fn a_plan_names_what_changes_and_what_breaks() {
    insta::assert_snapshot!(text::plan(&small()) + "\n" + &text::plan(&large()));
}

#[test]
fn a_shadow_report_names_the_first_difference_the_worst_and_the_inputs_that_caused_it() {
    let inputs = vec![("level".to_owned(), "7".to_owned()), ("start".to_owned(), "true".to_owned())];
    let level = Deviation {
        port: "outputs.level".into(),
        count: 3,
        first: 12_345_000_000,
        worst: 0.5,
        worst_at: 12_355_000_000,
        running: "1".into(),
        candidate: "1.5".into(),
        inputs: inputs.clone(),
    };
    let high = Deviation {
        port: "alarms.high".into(),
        count: 1,
        worst: 0.0,
        worst_at: 12_345_000_000,
        running: "false".into(),
        candidate: "true\u{1b}[2J".into(),
        inputs: Vec::new(),
        ..level.clone()
    };
    let fault = FailedRun { kind: "trap".into(), message: "unreachable".into(), at: 12_365_000_000, inputs };
    let bad = ShadowReport { deviations: vec![level, high], fault: Some(fault), missed: 2, ..report(3) };
    insta::assert_snapshot!(text::shadow(&report(0)) + "\n" + &text::shadow(&bad));
}

/// The way of a swap that goes well.
fn way() -> Vec<SwapStatus> {
    let shadow = |executions, left| SwapStatus {
        shadow: vec![ShadowReport { executions, ..report(0) }],
        left,
        ..status(Stage::Shadow)
    };
    let exchanged = |stage, left| SwapStatus {
        shadow: vec![report(0)],
        left,
        exchange_ns: 12_300,
        exchanged_at: 61_500_000_000,
        ..status(stage)
    };
    vec![
        SwapStatus { blocks: Vec::new(), ..status(Stage::Preparing) },
        SwapStatus { blocks: Vec::new(), ..status(Stage::Preparing) },
        shadow(0, 1000),
        shadow(300, 700),
        SwapStatus { shadow: vec![report(0)], ..status(Stage::Exchanging) },
        exchanged(Stage::Probation, 1000),
        exchanged(Stage::Probation, 400),
        SwapStatus { saved: true, ..exchanged(Stage::Done, 0) },
    ]
}

#[test]
fn a_swap_is_told_stage_by_stage_and_nothing_twice() {
    let mut teller = Teller::new(false, false);
    let said: String = way().iter().map(|s| teller.tell(s)).collect();
    insta::assert_snapshot!(said);
}

#[test]
fn on_a_terminal_one_line_counts() {
    let mut teller = Teller::new(true, true);
    let said: Vec<String> = way().iter().map(|s| format!("{:?}", teller.tell(s))).collect();
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn one_that_does_not_end_well_is_told_with_what_the_shadow_saw() {
    let ends = [
        SwapStatus { shadow: vec![report(3)], ..status(Stage::Refused) },
        SwapStatus { exchange_ns: 9_000, exchanged_at: 1_000_000_000, ..status(Stage::RolledBack) },
        SwapStatus { blocks: Vec::new(), ..status(Stage::Cancelled) },
        status(Stage::Planned),
    ];
    let said: Vec<String> = ends.iter().map(|s| Teller::new(false, true).tell(s)).collect();
    insta::assert_snapshot!(said.join("\n"));
}

#[test]
fn the_list_tells_what_became_of_each() {
    let refused = SwapStatus { number: 4, message: "tank has no input `level`".into(), ..status(Stage::Refused) };
    let saved = SwapStatus { saved: true, ..status(Stage::Done) };
    insta::assert_snapshot!(list(&[saved, refused, SwapStatus { number: 5, ..status(Stage::Probation) }]));
    assert_eq!(list(&[]), "there was no swap since the plant's start\n");
}

#[test]
fn spans_have_the_digits_that_matter() {
    for (ns, shown) in
        [(0, "0 ns"), (999, "999 ns"), (12_300, "12.3 µs"), (5_120_000, "5.1 ms"), (61_500_000_000, "61.5 s")]
    {
        assert_eq!(text::span(ns), shown);
    }
}
