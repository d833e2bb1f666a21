//! Operators at work while blocks are swapped, at virtual time.

use super::*;
use latchwork_plant::operate::{Answer, Operation, Refused};
use latchwork_plant::swap::{Part, Stage, SwapOrder, Tolerance, WayBack};
use latchwork_record::Record;
use latchwork_tests_plant::forge::Bad;
use std::collections::BTreeMap;

struct Told {
    answers: Vec<Result<Answer, Refused>>,
    records: Vec<Record>,
    kept: BTreeMap<String, String>,
}

/// Runs a plant for 1 s with wishes at their times, ms.
fn run(rig: &Rig, wishes: Vec<(u64, Operation)>) -> Told {
    let wishes = wishes.into_iter().map(|(ms, operation)| (ms * MS, operation)).collect();
    let (answers, log) = rig.operated(S, wishes);
    Told { answers, records: log.records, kept: log.kept }
}

impl Told {
    /// Values of the tags that a wish has read.
    fn read(&self, wish: usize) -> Vec<String> {
        match &self.answers[wish] {
            Ok(Answer::Tags(rows)) => rows.iter().map(|r| r.value.to_string()).collect(),
            other => panic!("{other:?}"),
        }
    }

    fn refused(&self, wish: usize) -> &str {
        &self.answers[wish].as_ref().expect_err("it is refused").message
    }

    fn told(&self, transition: &str) -> Vec<&str> {
        let of = |r: &&Record| r.kind == Kind::Swap && r.source == "count" && r.transition == transition;
        self.records.iter().filter(of).map(|r| r.text.as_str()).collect()
    }

    fn status(&self, wish: usize) -> &serde_json::Value {
        match &self.answers[wish] {
            Ok(Answer::Status(status)) => &status["blocks"][0],
            other => panic!("{other:?}"),
        }
    }
}

fn order(version: &Counter, probation: u64) -> SwapOrder {
    let file = format!("v{}.wasm", version.version);
    let bytes = version.component().into();
    SwapOrder {
        parts: vec![Part { block: "count".into(), file, bytes, settings: Vec::new(), expects: None }],
        shadow: 0,
        tolerances: Vec::new(),
        probation,
        allow_lossy: false,
        dry_run: false,
        save: false,
    }
}

fn swap(order: SwapOrder) -> Operation {
    Operation::Swap(Box::new(order))
}

fn back() -> Operation {
    Operation::Rollback { block: "count".into(), to: WayBack::Steps(1) }
}

fn to(hash: &str) -> Operation {
    Operation::Rollback { block: "count".into(), to: WayBack::To(hash.into()) }
}

fn read(tag: &str) -> Operation {
    Operation::Read { tags: vec![tag.into()] }
}

fn force(tag: &str) -> Operation {
    Operation::Force { tag: tag.into(), value: "1".into() }
}

/// A counter that nobody reads. The next scan is executed after the wishes of a time.
fn alone(first: &Counter) -> Rig {
    let text = "[lane.main]\nevery = \"10ms\"\n[block.count]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n";
    Rig::new(text).with("v1", &first.component()).trace(None)
}

#[test]
fn a_rollback_that_was_called_off_can_be_tried_again() {
    let first = Counter { retained: None, ..Counter::new(1) };
    let told = run(
        &alone(&first),
        vec![
            (195, read("count.outputs.count")),
            (200, swap(order(&Counter::new(2), 5))),
            (400, back()),
            (400, Operation::CancelSwap { number: 2 }),
            (500, back()),
            (600, read("count.outputs.*")),
        ],
    );
    assert_eq!(told.told("cancelled").len(), 1);
    let (before, after) = (&told.read(0)[0], told.read(5));
    // It retains nothing: only its instance knows how far it had counted.
    let count = |text: &str| text.parse::<u64>().expect("a count");
    assert_eq!(after[1], "1");
    assert!(count(&after[0]) > count(before) + 5, "{after:?} {before}");
}

#[test]
fn a_rollback_that_was_refused_can_be_tried_again() {
    let first = Counter { retained: None, ..Counter::new(1) };
    let double = Counter { double: true, ..Counter::new(2) };
    let told = run(
        &alone(&first),
        vec![
            (195, read("count.outputs.count")),
            (200, swap(order(&double, 0))),
            (300, force("count.outputs.double")),
            (400, back()),
            (450, Operation::Unforce { tag: "count.outputs.double".into() }),
            (500, back()),
            (600, read("count.outputs.*")),
        ],
    );
    let refused = told.told("refused");
    assert!(refused.len() == 1 && refused[0].contains("an operator forces `count.outputs.double`"), "{refused:?}");
    let (before, after) = (&told.read(0)[0], told.read(6));
    let count = |text: &str| text.parse::<u64>().expect("a count");
    assert_eq!(after[1], "1");
    assert!(count(&after[0]) > count(before) + 5, "{after:?} {before}");
}

#[test]
fn a_shadow_lets_deviations_pass_that_are_within_their_tolerances_and_no_others() {
    // From its fifth execution on it shows 2 more than the one that runs.
    let candidate = Counter { off: Some((5, 2)), ..Counter::new(2) };
    let within = |count| {
        let tolerance = |tag: &str, within| Tolerance { tag: tag.into(), within };
        let tolerances = vec![tolerance("count.outputs.version", 1.0), tolerance("count.outputs.count", count)];
        let shadowed = SwapOrder { shadow: 20, tolerances, ..order(&candidate, 5) };
        run(&alone(&Counter::new(1)), vec![(200, swap(shadowed)), (800, read("count.outputs.version"))])
    };
    let passes = within(2.0);
    assert_eq!((passes.told("exchanged").len(), passes.told("refused").len()), (1, 0), "{:#?}", passes.records);
    assert_eq!(passes.read(1), ["2"]);
    let differs = within(1.0);
    let refused = differs.told("refused");
    assert!(refused.len() == 1 && refused[0].contains("outputs.count"), "{refused:?}");
    assert!(!refused[0].contains("outputs.version"), "{refused:?}");
    assert_eq!((differs.told("exchanged").len(), differs.read(1)), (0, vec!["1".to_owned()]));
}

#[test]
fn a_tolerance_of_what_the_block_does_not_give_is_refused() {
    let tolerances = vec![Tolerance { tag: "count.outputs.cuont".into(), within: 1.0 }];
    let shadowed = SwapOrder { shadow: 20, tolerances, ..order(&Counter::new(2), 5) };
    let told = run(&alone(&Counter::new(1)), vec![(200, swap(shadowed)), (800, read("count.outputs.version"))]);
    let why = told.answers[0].as_ref().expect_err("a mistyped tag").to_string();
    assert!(why.contains("count.outputs.cuont") && why.contains("did you mean count.outputs.count?"), "{why}");
    assert_eq!(told.read(1), ["1"]);
}

#[test]
fn what_operators_have_begun_during_the_shadow_stops_a_swap() {
    let first = Counter { double: true, ..Counter::new(1) };
    // The version is an output: it differs, and may.
    let tolerances = vec![Tolerance { tag: "count.outputs.version".into(), within: 1.0 }];
    let shadowed = SwapOrder { shadow: 30, tolerances, ..order(&Counter::new(2), 5) };
    let told = run(
        &alone(&first),
        vec![(200, swap(shadowed)), (300, force("count.outputs.double")), (800, read("count.outputs.version"))],
    );
    let refused = told.told("refused");
    assert!(refused.len() == 1 && refused[0].contains("an operator forces `count.outputs.double`"), "{refused:?}");
    assert_eq!(told.read(2), ["1"]);
}

#[test]
fn an_earlier_version_is_found_by_its_hash() {
    let versions = [1, 2, 3].map(Counter::new);
    let hashes = versions.clone().map(|v| latchwork_block::Component::hash_of(&v.component()));
    let told = run(
        &alone(&versions[0]),
        vec![
            (100, swap(order(&versions[1], 0))),
            (200, swap(order(&versions[2], 0))),
            (300, Operation::Status),
            (310, to("xyz")),
            (320, to("")),
            (330, to(&hashes[2])),
            (400, to(&hashes[0][..10])),
            (500, Operation::Status),
            (600, back()),
            (700, Operation::Status),
        ],
    );
    let earlier = |wish| {
        let rows = told.status(wish)["earlier"].as_array().expect("a list").clone();
        rows.iter().for_each(|r| assert!(r["since"].as_u64() < r["until"].as_u64(), "{r}"));
        rows.iter().map(|r| r["hash"].as_str().expect("a hash").to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(earlier(2), [&hashes[1], &hashes[0]].map(String::as_str));
    for wish in [3, 4] {
        assert!(told.refused(wish).contains("no beginning of a hash"), "{}", told.refused(wish));
    }
    let unknown = told.refused(5);
    assert!(unknown.contains("no earlier version of `count` begins with"), "{unknown}");
    assert_eq!(told.status(7)["hash"], *hashes[0]);
    // What was left is what can be gone back to first.
    assert_eq!(earlier(7), [&hashes[2], &hashes[1]].map(String::as_str));
    assert_eq!(told.status(9)["hash"], *hashes[2]);
    assert!(told.told("asked")[2].contains(&format!("→ v1 {}", &hashes[0][..12])), "{:?}", told.told("asked"));
}

#[test]
fn during_a_probation_only_the_version_before_is_a_way_back_by_hash() {
    let versions = [1, 2, 3].map(Counter::new);
    let hashes = versions.clone().map(|v| latchwork_block::Component::hash_of(&v.component()));
    let told = run(
        &alone(&versions[0]),
        vec![
            (100, swap(order(&versions[1], 0))),
            (200, swap(order(&versions[2], 1000))),
            (300, to(&hashes[0])),
            (400, to(&hashes[1])),
            (500, Operation::Status),
        ],
    );
    assert!(told.refused(2).contains("go back one step first"), "{}", told.refused(2));
    assert_eq!(told.status(4)["hash"], *hashes[1]);
}

#[test]
fn a_lane_that_ends_during_a_probation_is_on_record_and_nothing_is_saved() {
    let text = "[lane.main]\nevery = \"10ms\"\n[lane.on]\nevery = \"10ms\"\n[block.count]\ncomponent = \"v1.wasm\"\n\
                lane = \"main\"\n[block.other]\ncomponent = \"other.wasm\"\nlane = \"main\"\non-fault = \"stop-lane\"\n\
                [block.third]\ncomponent = \"v1.wasm\"\nlane = \"on\"\n";
    let other = Counter::new(1).bad(Bad::Trap(50)).component();
    let rig = Rig::new(text).with("v1", &Counter::new(1).component()).with("other", &other).trace(None);
    let before = std::fs::read_to_string(rig.path()).expect("the plant file");
    let saved = SwapOrder { save: true, ..order(&Counter::new(2), 1000) };
    let told = run(&rig, vec![(200, swap(saved)), (900, Operation::Swaps { number: Some(1) })]);
    assert!(told.told("kept")[0].contains("its lane has ended"), "{:?}", told.told("kept"));
    assert!(told.told("not-saved")[0].contains("its lane has ended before"), "{:?}", told.told("not-saved"));
    let Ok(Answer::Swaps(swaps)) = &told.answers[1] else { panic!("{:?}", told.answers[1]) };
    assert_eq!((swaps[0].stage, swaps[0].saved), (Stage::Done, false));
    assert_eq!(std::fs::read_to_string(rig.path()).expect("the plant file"), before);
}

#[test]
fn what_is_saved_starts_again_with_the_settings_that_ran() {
    let text = "[plant]\nname = \"test\"\n[lane.main]\nevery = \"10ms\"\n[block.count]\ncomponent = \"v1.wasm\"\n\
                lane = \"main\"\n";
    // Its own proposal, and what was given: neither stands in the plant file.
    for (given, step) in [(vec![], "1"), (vec![("step".to_owned(), "7".to_owned())], "7")] {
        let rig = alone(&Counter::new(1)).trace(Some("*"));
        std::fs::write(rig.path(), text).expect("the plant file");
        let second = Counter { default_step: 9, ..Counter::new(2) };
        let mut saved = SwapOrder { save: true, ..order(&second, 5) };
        saved.parts[0].settings = given;
        let told = run(&rig, vec![(200, swap(saved))]);
        assert_eq!(told.told("saved").len(), 1, "{:#?}", told.told("not-saved"));
        let now = std::fs::read_to_string(rig.path()).expect("the plant file");
        assert!(now.contains(&format!("component = \"v2.wasm\"\nsettings.step = {step}\n")), "{now}");
        assert!(told.kept.keys().all(|k| !k.contains("step")), "{:?}", told.kept);
        let next = rig.after(&told.kept).run_for(100 * MS);
        assert_eq!((next.at("count.outputs.version", 0), next.at("count.outputs.count", 0)), ("2", step));
        assert!(next.told(Kind::Setting).is_empty(), "{:?}", next.told(Kind::Setting));
    }
}

#[test]
fn what_the_next_start_would_refuse_is_not_saved() {
    // The plant file's value is refused by the new version, and it cannot be changed: it stands in an inline table.
    let text = "[plant]\nname = \"test\"\n[lane.main]\nevery = \"10ms\"\n[block]\ncount = { component = \"v1.wasm\", \
                lane = \"main\", settings.step = 5 }\n";
    let rig = alone(&Counter::new(1));
    std::fs::write(rig.path(), text).expect("the plant file");
    let narrow = Counter::new(2).bad(Bad::RefusesBeyond(3));
    let mut saved = SwapOrder { save: true, ..order(&narrow, 5) };
    saved.parts[0].settings = vec![("step".into(), "2".into())];
    let told = run(&rig, vec![(200, swap(saved))]);
    assert_eq!(told.told("saved").len(), 1, "{:#?}", told.told("not-saved"));
    let now = std::fs::read_to_string(rig.path()).expect("the plant file");
    assert!(now.contains("settings.step = 2 }"), "{now}");
    assert_eq!(rig.run_for(100 * MS).outcome.lanes[0].statistics.scans, 10);
}
