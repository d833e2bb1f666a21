//! States in recordings: of what cannot be saved, and those that are waited for.

use super::*;
use latchwork_retain::{Found, Memory, Retained, Saved, Version};
use latchwork_tests_plant::Running;
use std::sync::Arc;
use std::time::Instant;

/// Ways in which a spare instance already fails at it.
const CANNOT: [Bad; 2] = [Bad::Save, Bad::SaveForEver];

fn states(segments: &[Segment]) -> usize {
    segments.iter().filter(|s| matches!(s.head.start, Start::State(_))).count()
}

#[track_caller]
fn no_fault(records: &[Record], block: &str) {
    let faults: Vec<_> = records.iter().filter(|r| r.kind == Kind::Fault && r.source == block).collect();
    assert!(faults.is_empty(), "{faults:#?}");
}

#[test]
fn a_block_whose_state_cannot_be_saved_is_recorded_from_its_cold_start_on_and_never_asked_for_one() {
    for bad in CANNOT {
        let (records, recording) = swapped([&Counter::new(1).bad(bad), &Counter::new(2)], "", "100ms", 2 * SECOND);
        no_fault(&records, "n");
        assert_eq!((states(segments(&recording)), &segments(&recording)[0].head.start), (0, &Start::Cold), "{bad:?}");
        let replayed = again(&recording, "n", &Options::default());
        assert!(replayed.equal() && replayed.recorded == replayed.replayed, "{bad:?}: {replayed:#?}");
        assert_eq!((replayed.executions, replayed.skipped, replayed.missed), (200, 0, 0), "{bad:?}");
    }
}

#[test]
fn a_version_whose_state_cannot_be_saved_is_recorded_from_the_exchange_on_and_never_asked_for_one() {
    // Between two states, and in the very turn in which one is due.
    for (bad, count) in CANNOT.into_iter().flat_map(|bad| [(bad, 55), (bad, 50)]) {
        let versions = [&Counter::new(1), &Counter::new(2).bad(bad)];
        let rows = format!("0.{count}s,swap.n,v2.wasm probation=5\n1s,n.settings.step,3\n");
        let (records, recording) = swapped(versions, &rows, "100ms", 2 * SECOND);
        no_fault(&records, "n");
        let second: Vec<_> =
            segments(&recording).iter().filter(|s| s.head.from >= count * SECOND / 100).cloned().collect();
        // That of the exchange, which the version before has saved.
        assert_eq!((states(&second), &second[0].head.start), (1, &Start::State(vec![count])), "{bad:?} {count}");
        let replayed = again(&recording, "n", &Options::default());
        assert!(replayed.equal(), "{bad:?}: {replayed:#?}");
        assert_eq!((replayed.executions, replayed.skipped, replayed.missed), (200, 0, 0), "{bad:?}");
    }
}

#[test]
fn a_state_that_is_wanted_of_the_version_before_is_not_asked_of_the_one_that_comes() {
    // The lane has no time for it until long after the exchange.
    let text = "[recorder]\nblocks = [\"n\"]\nkeyframe = \"200ms\"\n[lane.main]\nevery = \"10ms\"\n\
                [block.n]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n[sim.scan-time]\nmain = \"10ms\"\n";
    for bad in CANNOT {
        let second = Counter::new(2).bad(bad).component();
        let rig = Rig::new(text).sim().with("v1", &Counter::new(1).component()).with("v2", &second);
        let folder = TempDir::new().expect("a temporary folder");
        let rows = "0.55s,swap.n,v2.wasm probation=500\n";
        let records = run(rig.plant(Time::Virtual), Some(folder.path()), rows, 4 * SECOND);
        no_fault(&records, "n");
        let recording = Recording::open(folder.path()).expect("a recording");
        let replayed = again(&recording, "n", &Options::default());
        assert!(replayed.equal(), "{bad:?}: {replayed:#?}");
        assert_eq!((replayed.executions, replayed.missed), (400, 0), "{bad:?}");
    }
}

#[test]
fn a_block_that_fails_only_later_is_asked_once_and_not_again() {
    let versions = [&Counter::new(1).bad(Bad::SaveAfter(50)), &Counter::new(2)];
    let (records, recording) = swapped(versions, "", "200ms", 4 * SECOND);
    let faults: Vec<_> = records.iter().filter(|r| r.kind == Kind::Fault && r.source == "n").collect();
    let traps = faults.iter().filter(|r| r.transition == "trap").count();
    assert_eq!(traps, 1, "{faults:#?}");
    assert_eq!(states(segments(&recording)), 2, "before it failed");
    let last = segments(&recording).last().expect("a segment").head.to;
    assert_eq!(last, 4 * SECOND - 10_000_000, "it is recorded to the end");
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
}

/// By the machine's clock spare instances are asked on threads of their own.
#[test]
fn beside_a_running_plant_a_state_that_cannot_be_saved_is_found_out_without_the_block() {
    let text = "[recorder]\nlanes = [\"main\"]\nkeyframe = \"100ms\"\n[lane.main]\nevery = \"5ms\"\nwatchdog = \"20s\"\n\
                [block.good]\ncomponent = \"good.wasm\"\nlane = \"main\"\nbudget = \"2s\"\n\
                [block.traps]\ncomponent = \"traps.wasm\"\nlane = \"main\"\nbudget = \"2s\"\n\
                [block.loops]\ncomponent = \"loops.wasm\"\nlane = \"main\"\nbudget = \"100ms\"\n";
    let rig = Rig::new(text).trace(None).with("good", &Counter::new(1).component());
    let rig = rig.with("traps", &Counter::new(2).bad(CANNOT[0]).component());
    let rig = rig.with("loops", &Counter::new(3).bad(CANNOT[1]).component());
    let plant = Running::start(&rig);
    let end = Instant::now() + Duration::from_secs(60);
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("x.latchrec");
    let recording = loop {
        let Ok(Answer::Recording(bytes)) = plant.ask(Operation::Recording, "") else { panic!("no recording") };
        std::fs::write(&file, bytes).expect("written");
        // Before the first execution there is nothing in it.
        let recording = Recording::open(&file).ok();
        let of = |block| {
            let blocks = recording.iter().flat_map(|r| r.blocks(1));
            blocks.filter(|(name, _)| *name == block).flat_map(|(_, segments)| segments).cloned().collect::<Vec<_>>()
        };
        // By then the others would have been asked, too: they take turns.
        if states(&of("good")) > 5 && ["traps", "loops"].iter().all(|block| executions_of(&of(block)) > 100) {
            break recording.expect("a recording");
        }
        assert!(Instant::now() < end, "the good one is not asked: {:?}", of("good"));
        std::thread::sleep(Duration::from_millis(20));
    };
    let records = plant.end().records;
    for block in ["good", "traps", "loops"] {
        no_fault(&records, block);
        let (_, segments) = recording.blocks(1).find(|(name, _)| *name == block).expect("it is recorded");
        assert_eq!(states(segments) > 0, block == "good", "{block}");
        let replayed = again(&recording, block, &Options::default());
        assert!(replayed.equal() && replayed.missed == 0, "{replayed:#?}");
    }
}

fn executions_of(segments: &[Segment]) -> u64 {
    segments.iter().map(|s| s.head.executions).sum()
}

/// A counter that starts with a state of 1000, in a lane that has no time to save it for a second.
fn warm(rows: &str, duration: u64) -> (Vec<Record>, Recording) {
    let text = "[recorder]\nblocks = [\"n\"]\nkeyframe = \"10s\"\n[retain]\nevery = \"1h\"\n[lane.main]\nevery = \"10ms\"\n\
                [block.n]\ncomponent = \"v1.wasm\"\nlane = \"main\"\nretain = true\n[sim.scan-time]\nmain = \"10ms\"\n";
    let rig = Rig::new(text).sim().with("v1", &Counter::new(1).component()).with("v2", &Counter::new(2).component());
    let mut plant = rig.plant(Time::Virtual);
    let version = Arc::new(Version {
        class: "test:unit/counter@0.1.0".into(),
        component: "v1".into(),
        hash: String::new(),
        schema: "count:u32".into(),
    });
    let saved = Arc::new(Saved { version, time: 0, wall: 0, cells: [1000].into() });
    let found = Found::of(Retained { blocks: [("n".to_owned(), saved)].into() });
    plant.retain(&found, Box::new(Memory::default()));
    let folder = TempDir::new().expect("a temporary folder");
    let records = run(plant, Some(folder.path()), rows, duration);
    (records, Recording::open(folder.path()).expect("a recording"))
}

/// Counts that were recorded: first and last.
fn counts(segments: &[Segment]) -> (u64, u64) {
    let mut counts = Vec::new();
    each_event(segments, |event| {
        if let Event::Execution { outputs: Ok(outputs), .. } = event {
            counts.push(outputs[0]);
        }
    });
    (counts[0], *counts.last().expect("an execution"))
}

#[test]
fn settings_that_change_before_the_first_state_has_come_are_those_that_a_recording_begins_with() {
    let (records, recording) =
        warm("0.2s,n.settings.step,5\n0.4s,n.settings.step,7\n2.5s,n.settings.step,2\n", 3 * SECOND);
    no_fault(&records, "n");
    let first = &segments(&recording)[0].head;
    // What was before its state came is not in it.
    assert!(first.from > 4 * SECOND / 10, "{first:?}");
    assert_eq!(first.settings, [7]);
    // 20 by 1, 20 by 5, then by 7: what it holds when the first recorded execution begins.
    let before = 1000 + 20 + 100 + 7 * (first.from / 10_000_000 - 40);
    assert_eq!(first.start, Start::State(vec![before]));
    assert_eq!(counts(segments(&recording)).0, before + 7);
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal() && replayed.recorded == replayed.replayed, "{replayed:#?}");
    assert_eq!((replayed.skipped, replayed.missed, replayed.to), (0, 0, 3 * SECOND - 10_000_000));
    assert_eq!(replayed.executions, (3 * SECOND - first.from) / 10_000_000);
}

#[test]
fn a_swap_before_the_first_state_has_come_begins_the_recording_with_the_new_version() {
    let (records, recording) =
        warm("0.1s,n.settings.step,3\n0.2s,swap.n,v2.wasm probation=5\n1.5s,n.settings.step,2\n", 2 * SECOND);
    no_fault(&records, "n");
    assert!(records.iter().any(|r| r.kind == Kind::Swap && r.transition == "kept"), "{records:#?}");
    let first = &segments(&recording)[0].head;
    // 10 by 1 and 10 by 3.
    assert_eq!((first.from, &first.start, &first.settings[..]), (SECOND / 5, &Start::State(vec![1040]), &[3][..]));
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal() && replayed.recorded == replayed.replayed, "{replayed:#?}");
    assert_eq!((replayed.executions, replayed.skipped, replayed.missed), (180, 0, 0), "{replayed:#?}");
    assert_eq!(counts(segments(&recording)), (1043, 1040 + 130 * 3 + 50 * 2));
}

#[test]
fn a_version_that_is_taken_back_before_its_first_state_has_come_is_recorded_from_then_on() {
    let (records, recording) =
        warm("0.1s,n.settings.step,3\n0.2s,swap.n,v2.wasm probation=50\n0.4s,rollback.n,1\n", SECOND);
    no_fault(&records, "n");
    assert!(records.iter().any(|r| r.kind == Kind::Swap && r.transition == "rolled-back"), "{records:#?}");
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal() && replayed.recorded == replayed.replayed, "{replayed:#?}");
    assert_eq!((replayed.executions, replayed.skipped, replayed.missed), (80, 0, 0), "{replayed:#?}");
    // The version before is back with its own count.
    assert_eq!(counts(segments(&recording)), (1043, 1040 + 60 * 3));
}

#[test]
fn where_there_is_no_time_for_all_states_no_block_is_left_out() {
    // A lane gives one state per scan at most: a round takes longer than the interval.
    let blocks = 40;
    let names: Vec<_> = (0..blocks).map(|n| format!("\"n{n}\"")).collect();
    let mut text =
        format!("[recorder]\nblocks = [{}]\nkeyframe = \"100ms\"\n[lane.main]\nevery = \"10ms\"\n", names.join(", "));
    (0..blocks).for_each(|n| text += &format!("[block.n{n}]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n"));
    let rig = Rig::new(&text).with("v1", &Counter::new(1).component());
    let folder = TempDir::new().expect("a temporary folder");
    run(rig.plant(Time::Virtual), Some(folder.path()), "", 5 * SECOND);
    let recording = Recording::open(folder.path()).expect("a recording");
    let few: Vec<_> = recording
        .blocks(last_run(&recording))
        .map(|(name, segments)| (name.to_string(), states(segments)))
        .filter(|(_, states)| *states < 4)
        .collect();
    assert!(few.is_empty(), "{few:?}");
}
