//! Swaps by the machine's clock, through the operators' console.

use super::*;
use latchwork_plant::lane::Change;
use latchwork_plant::operate::{Answer, Operation, Refused};
use latchwork_plant::swap::{Part, Stage, SwapOrder, SwapStatus, WayBack};
use latchwork_record::Record;
use latchwork_tests_plant::forge::Bad;
use serde_json::Value;
use std::time::{Duration, Instant};

/// A plant of two counters.
struct Running(latchwork_tests_plant::Running);

const PLANT: &str = "[lane.main]\nevery = \"5ms\"\nwatchdog = \"5s\"\n[block.count]\ncomponent = \"v1.wasm\"\n\
                     lane = \"main\"\nbudget = \"2s\"\n[block.other]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n\
                     budget = \"2s\"\n";

impl Running {
    fn new() -> Self {
        let rig = Rig::new(PLANT).with("v1", &Counter::new(1).component()).trace(Some("count.outputs.count"));
        Self(latchwork_tests_plant::Running::start(&rig))
    }

    fn ask(&self, operation: Operation) -> Result<Answer, Refused> {
        self.0.ask(operation, "a new filter")
    }

    fn swap(&self, order: SwapOrder) -> u64 {
        match self.ask(Operation::Swap(Box::new(order))) {
            Ok(Answer::Swap(status)) => {
                assert_eq!(status.stage, Stage::Preparing);
                status.number
            }
            other => panic!("{other:?}"),
        }
    }

    fn look(&self, number: u64) -> SwapStatus {
        match self.ask(Operation::Swaps { number: Some(number) }) {
            Ok(Answer::Swaps(rows)) => rows[0].clone(),
            other => panic!("{other:?}"),
        }
    }

    /// Waits for a swap to get so far.
    fn until(&self, number: u64, stage: Stage) -> SwapStatus {
        let end = Instant::now() + Duration::from_secs(120);
        loop {
            let status = self.look(number);
            if status.stage == stage {
                return status;
            }
            assert!(!status.stage.ended() && Instant::now() < end, "never {stage:?}: {status:#?}");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn row(&self, block: usize) -> Value {
        match self.ask(Operation::Status) {
            Ok(Answer::Status(status)) => status["blocks"][block].clone(),
            other => panic!("{other:?}"),
        }
    }

    fn end(self) -> (Vec<Record>, Vec<Change>) {
        let log = self.0.end();
        (log.records, log.changes)
    }
}

fn order(version: &Counter, probation: u64) -> SwapOrder {
    let part = Part {
        block: "count".into(),
        file: format!("v{}.wasm", version.version),
        bytes: version.component().into(),
        settings: Vec::new(),
        expects: None,
    };
    SwapOrder {
        parts: vec![part],
        shadow: 0,
        tolerances: Vec::new(),
        probation,
        allow_lossy: false,
        dry_run: false,
        save: false,
    }
}

#[test]
fn what_was_planned_is_swapped_only_in_the_place_of_what_was_seen_then() {
    let plant = Running::new();
    let plan = plant.swap(SwapOrder { dry_run: true, ..order(&Counter::new(3), 0) });
    let seen = plant.until(plan, Stage::Planned).blocks[0].old.hash.clone();
    let expecting = |version, hash: &str| {
        let mut order = order(&Counter::new(version), 0);
        order.parts[0].expects = Some(hash.to_owned());
        order
    };
    // Somebody else is faster.
    let other = plant.swap(order(&Counter::new(2), 0));
    let runs = plant.until(other, Stage::Done).blocks[0].new.hash.clone();
    let why = plant.ask(Operation::Swap(Box::new(expecting(3, &seen)))).expect_err("it is refused");
    assert!(why.message.contains(&runs[..12]) && why.message.contains(&seen[..12]), "{}", why.message);
    assert_eq!(plant.row(0)["hash"], runs.as_str());
    let number = plant.swap(expecting(3, &runs));
    plant.until(number, Stage::Done);
    plant.end();
}

#[test]
fn a_plan_tells_everything_and_changes_nothing() {
    let plant = Running::new();
    let newer = Counter { retained: Some("u64"), settings: &[("limit", "u32")], ..Counter::new(2) };
    let number = plant.swap(SwapOrder { dry_run: true, ..order(&newer, 0) });
    let status = plant.until(number, Stage::Planned);
    let mut plan = serde_json::to_value(&status.blocks[0]).expect("JSON");
    for version in ["old", "new"] {
        assert_eq!(plan[version]["hash"].as_str().map(str::len), Some(64));
        assert!(plan[version]["size"].as_u64().is_some_and(|s| s > 100));
        plan[version]["hash"] = "…".into();
        plan[version]["size"] = 0.into();
    }
    insta::assert_json_snapshot!(plan);
    assert_eq!(plant.row(0)["component"], "v1");
    assert!(plant.end().0.iter().all(|r| r.kind != Kind::Swap));
}

#[test]
fn the_status_tells_what_runs_since_when_and_by_whom() {
    let plant = Running::new();
    let before = plant.row(0);
    assert_eq!(
        (&before["component"], &before["differs"], &before["versions"]),
        (&"v1".into(), &false.into(), &0.into())
    );
    let number = plant.swap(order(&Counter::new(2), 1_000_000));
    let status = plant.until(number, Stage::Probation);
    assert!(status.left > 0 && status.exchanged_at > 0, "{status:#?}");
    let row = plant.row(0);
    assert_eq!((&row["component"], &row["differs"], &row["by"]), (&"v2".into(), &true.into(), &"anna".into()));
    assert_eq!((&row["versions"], &row["swap"]), (&1.into(), &"probation".into()));
    assert_eq!(row["since"].as_u64(), Some(status.exchanged_at));
    assert_ne!(row["hash"], before["hash"]);
    let Ok(Answer::Swap(back)) = plant.ask(Operation::Rollback { block: "count".into(), to: WayBack::Steps(1) }) else {
        panic!("no rollback")
    };
    plant.until(back.number, Stage::Done);
    assert_eq!(plant.until(number, Stage::RolledBack).message, "taken back by anna with swap 2");
    assert_eq!(plant.row(0)["hash"], before["hash"]);
    let (records, _) = plant.end();
    let asked = records.iter().find(|r| r.transition == "asked").expect("a record");
    assert_eq!((asked.user.as_str(), asked.source.as_str()), ("anna", "count"));
    assert!(asked.text.ends_with("→ v2.wasm; from cli; because a new filter"), "{}", asked.text);
}

#[test]
fn orders_that_cannot_be_begun_are_refused_at_once() {
    let plant = Running::new();
    let refused = |order: SwapOrder| match plant.ask(Operation::Swap(Box::new(order))) {
        Err(refused) => (refused.reason, refused.message),
        other => panic!("{other:?}"),
    };
    let with = |change: &dyn Fn(&mut Part)| {
        let mut order = order(&Counter::new(2), 10);
        change(&mut order.parts[0]);
        refused(order)
    };
    assert_eq!(with(&|p| p.block = "cuont".into()).1, "there is no block `cuont`; did you mean `count`?");
    assert_eq!(
        with(&|p| p.bytes = vec![0; 100 << 20].into()).1,
        "`v2.wasm` has 100 MiB; a component of up to 64 MiB is taken"
    );
    assert_eq!(refused(SwapOrder { parts: Vec::new(), ..order(&Counter::new(2), 10) }).0, "value");
    let number = plant.swap(order(&Counter::new(2), 1_000_000));
    let (reason, why) = refused(order(&Counter::new(3), 10));
    assert_eq!(reason, "busy");
    assert!(why.starts_with("swap 1 of the same block is "), "{why}");
    plant.until(number, Stage::Probation);
    let Err(why) = plant.ask(Operation::CancelSwap { number }) else { panic!("called off") };
    assert_eq!(why.message, "swap 1 is on probation; take it back with `rollback`");
    let Err(why) = plant.ask(Operation::CancelSwap { number: 7 }) else { panic!("called off") };
    assert_eq!(why.message, "there is no swap 7; 1 have been ordered since the plant's start");
    plant.end();
}

#[test]
fn a_swap_that_is_called_off_has_no_effect() {
    let plant = Running::new();
    // Whatever it has reached by then, the shadow is longer than the test.
    let number = plant.swap(SwapOrder { shadow: 1_000_000, ..order(&Counter { version: 1, ..Counter::new(1) }, 10) });
    plant.until(number, Stage::Shadow);
    let Ok(Answer::Done { done }) = plant.ask(Operation::CancelSwap { number }) else { panic!("not called off") };
    assert_eq!(done, ["swap 1 is called off"]);
    assert_eq!(plant.look(number).stage, Stage::Cancelled);
    assert_eq!(plant.row(0)["versions"], 0);
    let (records, _) = plant.end();
    assert!(records.iter().any(|r| r.transition == "cancelled"));
}

#[test]
fn a_counter_never_steps_back_or_skips_while_its_block_is_swapped_again_and_again() {
    let plant = Running::new();
    for n in 2..=13 {
        let number = plant.swap(order(&Counter::new(n), u64::from(n % 3)));
        let status = plant.until(number, Stage::Done);
        assert!(status.prepare_ns > 0, "{status:#?}");
    }
    // What is told of swaps is bounded, and so are the versions that are kept.
    assert_eq!(plant.row(0)["versions"], 8);
    let (records, changes) = plant.end();
    let counts: Vec<_> = changes.iter().map(|c| c.cell).collect();
    let expected: Vec<_> = (1..=counts.len() as u64).collect();
    assert_eq!(counts, expected);
    for transition in ["asked", "exchanged"] {
        assert_eq!(records.iter().filter(|r| r.transition == transition).count(), 12, "{transition}");
    }
}

#[test]
fn a_candidate_that_fails_in_its_probation_is_rolled_back() {
    let plant = Running::new();
    let number = plant.swap(order(&Counter::new(2).bad(Bad::Trap(10)), 1_000_000));
    let status = plant.until(number, Stage::RolledBack);
    assert!(status.message.contains("unreachable code"), "{status:#?}");
    assert_eq!(plant.row(0)["component"], "v1");
    plant.end();
}

#[test]
fn a_version_that_takes_too_long_to_restore_is_refused_beside_the_lane() {
    let plant = Running::new();
    let number = plant.swap(order(&Counter::new(2).bad(Bad::RestoreSlowly), 10));
    let status = plant.until(number, Stage::Refused);
    assert!(status.message.contains("us to restore; its lane has 5000 us for a whole scan"), "{status:#?}");
    assert_eq!(plant.row(0)["component"], "v1");
    plant.end();
}
