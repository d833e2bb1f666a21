//! The flight recorder of a plant, and replays of what it has recorded.

use latchwork_block::{Engine, FaultKind, Ticker};
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::Change;
use latchwork_plant::operate::{Answer, Operation, Operator};
use latchwork_plant::run::{Control, Observer, RunOptions, resolve_stimulus, run_virtual};
use latchwork_record::{Kept, Kind, Record};
use latchwork_testbed::replay::{Event, Head, Options, Recording, Replayed, Start, Tolerances, export, replay};
use latchwork_tests_plant::forge::{Bad, Counter};
use latchwork_tests_plant::{Rig, engine};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use tempfile::TempDir;

const SECOND: u64 = 1_000_000_000;

const PLANT: &str = r#"
[recorder]
blocks = ["unit", "count"]
keyframe = "500ms"
[lane.main]
every = "10ms"
[driver.field]
kind = "sim"
points.level = { type = "u16" }
points.door = { type = "bool" }
[block.clock]
component = "multivibrator"
lane = "main"
inputs.run = true
settings.on-time = "50ms"
settings.off-time = "30ms"
[block.unit]
component = "alarm-unit"
lane = "main"
inputs.level = "field.level"
inputs.door = "field.door"
[block.count]
component = "ctu"
lane = "main"
inputs.cu = "clock.outputs.out"
inputs.pv = 20
"#;

const STIMULUS: &str = "0.2s,field.level,300\n0.5s,field.door,true\n0.9s,field.level,65535\n1.3s,field.door,false\n\
                        1.5s,unit.commands.reset,true\n2.1s,field.level,0\n";

#[derive(Default)]
struct Watch {
    records: Vec<Record>,
}

impl Observer for Watch {
    fn record(&mut self, record: &Record, _: &[Kept]) {
        self.records.push(record.clone());
    }
    fn change(&mut self, _: &Change) {}
    fn tick(&mut self, _: u64) -> Control {
        Control::Continue
    }
}

fn run(mut plant: Plant, folder: Option<&Path>, stimulus: &str, duration: u64) -> Vec<Record> {
    if let Some(folder) = folder {
        plant.record_into(folder).expect("a folder that can be written");
    }
    let rows =
        latchwork_io::stimulus::read(format!("time,tag,value\n{stimulus}").as_bytes()).expect("a right stimulus");
    let stimulus = resolve_stimulus(&plant, &rows).expect("a stimulus that fits");
    let options = RunOptions { duration: Some(duration), stimulus, ..RunOptions::default() };
    let mut watch = Watch::default();
    run_virtual(plant, &options, &AtomicBool::new(false), &mut watch);
    watch.records
}

/// The plant above, recorded for three seconds.
fn recorded() -> (TempDir, PathBuf) {
    let folder = TempDir::new().expect("a temporary folder");
    let into = folder.path().join("recorder");
    run(Rig::new(PLANT).plant(Time::Virtual), Some(&into), STIMULUS, 3 * SECOND);
    (folder, into)
}

fn again(recording: &Recording, block: &str, options: &Options) -> Replayed {
    let engine = engine();
    let _ticker = Ticker::start(&engine, Duration::from_millis(10));
    replay(recording, &engine, last_run(recording), block, options).expect("it can be replayed")
}

fn last_run(recording: &Recording) -> u64 {
    *recording.runs().last().expect("a run")
}

fn executions(recording: &Recording, block: &str) -> u64 {
    let (_, segments) = recording.blocks(last_run(recording)).find(|(name, _)| *name == block).expect("the block");
    segments.iter().map(|s| s.head.executions).sum()
}

#[test]
fn what_a_plant_has_recorded_is_replayed_equal_bit_for_bit() {
    let (_folder, path) = recorded();
    let recording = Recording::open(&path).expect("a recording");
    assert_eq!(recording.damage, Vec::<String>::new());
    let blocks: Vec<_> = recording.blocks(1).map(|(name, _)| name.to_string()).collect();
    assert_eq!(blocks, ["count", "unit"], "those that were chosen, and no others");
    for block in ["count", "unit"] {
        let replayed = again(&recording, block, &Options::default());
        assert!(replayed.equal(), "{replayed:#?}");
        assert_eq!((replayed.executions, replayed.skipped, replayed.missed), (300, 0, 0));
        assert_eq!(replayed.recorded, replayed.replayed);
        assert_eq!(replayed.notes, Vec::<String>::new());
    }
}

#[test]
fn a_replay_of_a_later_part_begins_with_the_state_before_it() {
    let (_folder, path) = recorded();
    let recording = Recording::open(&path).expect("a recording");
    for block in ["count", "unit"] {
        let options = Options { from: 2 * SECOND, to: 2 * SECOND + 499_999_999, ..Options::default() };
        let replayed = again(&recording, block, &options);
        assert!(replayed.equal(), "{replayed:#?}");
        assert_eq!((replayed.from, replayed.executions), (2 * SECOND, 50));
    }
}

#[test]
fn the_same_run_makes_the_same_recording_to_the_byte() {
    let bytes = || {
        let (_folder, path) = recorded();
        Recording::open(&path).expect("a recording").to_bytes()
    };
    assert_eq!(bytes(), bytes());
}

#[test]
fn a_changed_recording_is_found_different() {
    let (_folder, path) = recorded();
    let recording = Recording::open(&path).expect("a recording");
    let (_, segments) = recording.blocks(1).find(|(name, _)| *name == "count").expect("the block");
    // The same executions, but for one output that says something else.
    let mut changed = latchwork_testbed::replay::header();
    changed.extend(latchwork_testbed::replay::component_chunk(
        recording.component(&segments[0].head.hash).expect("its component"),
    ));
    for (n, segment) in segments.iter().enumerate() {
        let head = Head { executions: 0, missed: 0, ..segment.head.clone() };
        let mut writer = latchwork_testbed::replay::Writer::new(head);
        let mut events = segment.events();
        let mut at = 0;
        while let Some(event) = events.next_event().expect("whole") {
            let Event::Execution { scan, arguments, outputs: Ok(outputs) } = event else { continue };
            let mut outputs = outputs.to_vec();
            outputs[1] ^= u64::from(n == 1 && at == 7);
            writer.add(Event::Execution { scan, arguments, outputs: Ok(&outputs) });
            at += 1;
        }
        changed.extend(latchwork_testbed::replay::segment_chunk(&writer.cut(Start::Continued).expect("not empty")));
    }
    let file = TempDir::new().expect("a folder");
    let file = file.path().join("changed.latchrec");
    std::fs::create_dir_all(file.parent().expect("a folder")).expect("made");
    std::fs::write(&file, changed).expect("written");
    let replayed = again(&Recording::open(&file).expect("a recording"), "count", &Options::default());
    assert!(!replayed.equal());
    assert_ne!(replayed.recorded, replayed.replayed);
    assert_eq!(replayed.different, 1);
    assert_eq!(replayed.deviations[0].port, "outputs.cv");
    assert_eq!(replayed.deviations[0].worst, 1.0);
}

/// A plant with a counter, recorded for a second.
fn counter(counter: &Counter, keyframe: &str) -> (TempDir, Recording) {
    let text = format!(
        "[recorder]\nlanes = [\"main\"]\nkeyframe = \"{keyframe}\"\n[lane.main]\nevery = \"10ms\"\n\
         [block.n]\ncomponent = \"counter.wasm\"\nlane = \"main\"\nsettings.step = 2\n"
    );
    let rig = Rig::new(&text).with("counter", &counter.component());
    let folder = TempDir::new().expect("a temporary folder");
    run(rig.plant(Time::Virtual), Some(folder.path()), "0.4s,n.settings.step,5\n0.7s,n.commands.clear,true\n", SECOND);
    let recording = Recording::open(folder.path()).expect("a recording");
    (folder, recording)
}

fn with(engine: &Engine, counter: &Counter) -> Options {
    let other = engine.load_bytes("counter-2", &counter.component()).expect("a component");
    Options { with: Some(other), ..Options::default() }
}

#[test]
fn settings_and_commands_are_in_the_recording() {
    let (_folder, recording) = counter(&Counter::new(1), "10s");
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!(replayed.executions, 100);
    let (_, segments) = recording.blocks(1).next().expect("a block");
    let mut settings = 0;
    for segment in segments {
        let mut events = segment.events();
        while let Some(event) = events.next_event().expect("whole") {
            settings += u64::from(matches!(event, Event::Settings { .. }));
        }
    }
    assert_eq!(settings, 1);
}

#[test]
fn settings_written_between_two_executions_are_replayed_and_reach_the_shadow() {
    // Twice between the same two executions, and while a lane that has no time to spare still owes the shadow a state.
    let rows = "0.4s,n.settings.step,5\n0.404s,n.settings.step,7\n1s,swap.n,v2.wasm shadow=150 probation=5\n\
                1.5s,n.settings.step,3\n2.5s,n.settings.step,4\n";
    let text = "[recorder]\nblocks = [\"n\"]\nkeyframe = \"300ms\"\n[lane.main]\nevery = \"10ms\"\n\
                [block.n]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n[sim.scan-time]\nmain = \"10ms\"\n";
    let counter = Counter::new(1).component();
    let other = Counter { default_step: 9, ..Counter::new(1) }.component();
    let rig = Rig::new(text).sim().with("v1", &counter).with("v2", &other);
    let folder = TempDir::new().expect("a temporary folder");
    let records = run(rig.plant(Time::Virtual), Some(folder.path()), rows, 5 * SECOND);
    let swaps: Vec<_> = records.iter().filter(|r| r.kind == Kind::Swap).map(|r| &*r.transition).collect();
    assert_eq!(swaps, ["asked", "shadow", "exchanged", "kept"], "{records:#?}");
    let recording = Recording::open(folder.path()).expect("a recording");
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!((replayed.executions, replayed.skipped), (500, 0));
}

#[test]
fn a_budget_that_was_exceeded_is_left_out_of_the_comparison_and_told() {
    let (_folder, recording) = counter(&Counter::new(1).bad(Bad::Loop(31)), "10s");
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!(replayed.recorded, replayed.replayed);
    assert_eq!(replayed.skipped, 0);
    assert!(replayed.executions > 31, "also what came after its restart: {}", replayed.executions);
    let faults = executions(&recording, "n") - replayed.executions;
    assert_eq!((faults, replayed.notes.len()), (2, 2), "{replayed:#?}");
    assert!(replayed.notes[0].starts_with("at 300ms it exceeded its budget when it was recorded"), "{replayed:#?}");
}

#[test]
fn a_recorded_fault_of_another_kind_does_not_depend_on_the_machine() {
    let (_folder, recording) = counter(&Counter::new(1), "10s");
    for (kind, equal, note) in [
        (FaultKind::Trap, false, "the recorded fault (trap) at 990ms did not happen again"),
        (FaultKind::Budget, true, "at 990ms it exceeded its budget when it was recorded"),
    ] {
        let (_folder, recording) = rewritten(&recording, |n, event| match event {
            Event::Execution { scan, arguments, .. } if n == 100 => {
                Event::Execution { scan, arguments, outputs: Err(kind) }
            }
            event => event,
        });
        let replayed = again(&recording, "n", &Options::default());
        assert_eq!(replayed.equal(), equal, "{replayed:#?}");
        assert_eq!(replayed.recorded == replayed.replayed, equal);
        assert_eq!(replayed.different, u64::from(!equal));
        assert_eq!(replayed.notes.len(), 1);
        assert!(replayed.notes[0].starts_with(note), "{replayed:#?}");
    }
}

/// The same recording of a counter with other events; the first one is number 0.
fn rewritten(
    recording: &Recording,
    mut change: impl for<'a> FnMut(usize, Event<'a>) -> Event<'a>,
) -> (TempDir, Recording) {
    let mut bytes = latchwork_testbed::replay::header();
    let (_, segments) = recording.blocks(1).next().expect("a block");
    let component = recording.component(&segments[0].head.hash).expect("its component");
    bytes.extend(latchwork_testbed::replay::component_chunk(component));
    let mut n = 0;
    for segment in segments {
        let head = Head { executions: 0, missed: 0, ..segment.head.clone() };
        let mut writer = latchwork_testbed::replay::Writer::new(head);
        let mut events = segment.events();
        while let Some(event) = events.next_event().expect("whole") {
            writer.add(change(n, event));
            n += 1;
        }
        bytes.extend(latchwork_testbed::replay::segment_chunk(&writer.cut(Start::Continued).expect("not empty")));
    }
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("rewritten.latchrec");
    std::fs::write(&file, bytes).expect("written");
    let recording = Recording::open(&file).expect("a recording");
    (folder, recording)
}

#[test]
fn with_another_component_the_differences_are_listed() {
    let (_folder, recording) = counter(&Counter::new(1), "10s");
    let engine = engine();
    let other = Counter { off: Some((51, 3)), double: true, ..Counter::new(1) };
    let replayed = again(&recording, "n", &with(&engine, &other));
    assert!(!replayed.equal());
    assert_eq!((replayed.executions, replayed.different), (100, 50), "{replayed:#?}");
    let ports: Vec<_> = replayed.deviations.iter().map(|d| (d.port.as_str(), d.count, d.first, d.worst)).collect();
    assert_eq!(ports, [("outputs.count", 50, 500_000_000, 3.0)]);
    // The same with a tolerance is none.
    let options =
        Options { tolerances: Tolerances::new([("n.outputs.count", 3.0)]).expect("right"), ..with(&engine, &other) };
    assert!(again(&recording, "n", &options).equal());
}

#[test]
fn a_fault_that_only_the_other_component_has_is_told() {
    let (_folder, recording) = counter(&Counter::new(1), "10s");
    let engine = engine();
    let other = Counter::new(1).bad(Bad::Trap(31));
    let replayed = again(&recording, "n", &with(&engine, &other));
    let fault = replayed.fault.as_ref().expect("a fault");
    assert_eq!((fault.kind.as_str(), fault.at), ("trap", 300_000_000));
    assert_eq!(replayed.executions + replayed.skipped, 100);
    assert!(!replayed.equal());
}

#[test]
fn faults_and_restarts_are_replayed_too() {
    let (_folder, recording) = counter(&Counter::new(1).bad(Bad::Trap(31)), "10s");
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert!(replayed.executions > 31, "also what came after its restart: {}", replayed.executions);
    assert_eq!(replayed.skipped, 0);
}

#[test]
fn a_class_that_retains_nothing_is_exact_only_from_its_cold_start_and_the_report_says_so() {
    let (_folder, recording) = counter(&Counter { retained: None, ..Counter::new(1) }, "200ms");
    let whole = again(&recording, "n", &Options::default());
    assert!(whole.equal() && whole.notes.is_empty(), "{whole:#?}");
    // Without its beginning, as after the oldest files have gone.
    let (_, segments) = recording.blocks(1).next().expect("a block");
    let mut bytes = latchwork_testbed::replay::header();
    bytes.extend(latchwork_testbed::replay::component_chunk(recording.component(&segments[0].head.hash).expect("it")));
    segments[1..].iter().for_each(|s| bytes.extend(latchwork_testbed::replay::segment_chunk(s)));
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("late.latchrec");
    std::fs::write(&file, bytes).expect("written");
    let late = again(&Recording::open(&file).expect("a recording"), "n", &Options::default());
    assert!(late.notes.iter().any(|n| n.contains("retains nothing")), "{late:#?}");
    assert!(!late.equal(), "its count is not in the recording");
}

#[test]
fn a_torn_or_damaged_file_costs_what_is_torn_and_no_more() {
    let (_folder, path) = recorded();
    let file = std::fs::read_dir(&path)
        .expect("a folder")
        .map(|e| e.expect("an entry").path())
        .find(|p| p.extension().is_some_and(|e| e == "latchrec"))
        .expect("a file of segments");
    let whole = std::fs::read(&file).expect("it can be read");
    let all = executions(&Recording::open(&path).expect("whole"), "count");
    for length in [whole.len() - 1, whole.len() - 100, whole.len() / 2] {
        std::fs::write(&file, &whole[..length]).expect("written");
        let recording = Recording::open(&path).expect("the rest is a recording");
        assert_eq!(recording.damage.len(), 1, "{:?}", recording.damage);
        assert!(recording.damage[0].contains("torn at byte"), "{:?}", recording.damage);
        let replayed = again(&recording, "count", &Options::default());
        assert!(replayed.equal(), "{replayed:#?}");
        assert!(replayed.executions <= all);
    }
    // A bit of a segment in the middle: its executions are gone until the next state.
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 4;
    std::fs::write(&file, damaged).expect("written");
    let recording = Recording::open(&path).expect("the rest is a recording");
    assert!(recording.damage[0].contains("its checksum is wrong"), "{:?}", recording.damage);
    let replayed = again(&recording, "count", &Options::default());
    assert!(replayed.equal() && replayed.executions > 100, "{replayed:#?}");
    let left: u64 = ["count", "unit"].iter().map(|block| executions(&recording, block)).sum();
    assert!(left < 2 * all, "{left}");
}

/// CRC-32 as the format has it.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| step(crc)))
}

/// A chunk whose checksum is right, whatever is in it.
fn chunk(kind: u8, payload: &[u8]) -> Vec<u8> {
    let length = u32::try_from(payload.len()).expect("short");
    [&[kind][..], &length.to_le_bytes(), &crc32(payload).to_le_bytes(), payload].concat()
}

/// The chunks of a file: kind and payload.
fn chunks(file: &[u8]) -> Vec<(u8, Vec<u8>)> {
    let (mut rest, mut chunks) = (&file[12..], Vec::new());
    while let Some((kind, after)) = rest.split_first() {
        let length = u32::from_le_bytes(after[..4].try_into().expect("four")) as usize;
        chunks.push((*kind, after[8..8 + length].to_vec()));
        rest = &after[8 + length..];
    }
    chunks
}

#[test]
fn a_segment_that_contradicts_itself_is_refused_with_file_and_place_and_holds_nothing_up() {
    let (_folder, recording) = counter(&Counter::new(1), "300ms");
    let mut file = latchwork_testbed::replay::header();
    let whole = chunks(&recording.to_bytes());
    // The component and the first segment are right.
    whole[..2].iter().for_each(|(kind, payload)| file.extend(chunk(*kind, payload)));
    let place = file.len();
    let head = &recording.blocks(1).next().expect("a block").1[1].head;
    let endless = [vec![3], vec![0xff; 9], vec![1]].concat();
    let with = |executions, missed| Head { executions, missed, ..head.clone() };
    let cases: Vec<(&str, Head, &[u8])> = vec![
        ("it has more executions than it says", with(3, 0), &endless),
        ("it says that it has more executions than a segment may have", with(u64::MAX, 0), &endless),
        ("it has more executions than it says", with(1 << 16, 0), &endless),
        ("it has fewer executions than it says", with(1, 0), &[]),
        ("it misses other executions than it says", with(0, 7), &[]),
        ("nothing is repeated", with(5, 0), &[3, 0]),
        ("a number does not end", with(5, 0), &[3, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 1]),
        ("a fault of a kind that there is not", with(1, 0), &[8, 200]),
        ("its time goes back", with(2, 0), &[64, 40, 64, 59]),
        ("a cell that the class does not have", with(1, 0), &[16, 1, 99, 0]),
        ("a cell of more than eight bytes", with(1, 0), &[16, 1, 0, 0xff]),
        ("it ends in the middle", with(1, 0), &[16, 1, 0]),
        ("its number is the last that there is", Head { number: u64::MAX, ..with(0, 0) }, &[]),
        ("a block with more cells than a class has", Head { cells: [usize::MAX, 1], ..with(0, 0) }, &[]),
    ];
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("x.latchrec");
    for (sentence, head, events) in cases {
        let head = serde_json::to_vec(&head).expect("a head");
        let length = u32::try_from(head.len()).expect("short").to_le_bytes();
        let bytes = [&file[..], &chunk(2, &[&length[..], &head, events].concat())].concat();
        std::fs::write(&path, bytes).expect("written");
        let recording = Recording::open(&path).expect("the first segment is right");
        let told = format!("{}: the chunk at byte {place} is left out: {sentence}", path.display());
        assert_eq!(recording.damage, [told]);
        assert!(again(&recording, "n", &Options::default()).equal());
    }
}

#[test]
fn no_damage_under_a_right_checksum_makes_a_replay_panic_or_hang() {
    let (_folder, recording) = counter(&Counter::new(1).bad(Bad::Trap(31)), "100ms");
    let whole = chunks(&recording.to_bytes());
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("x.latchrec");
    let engine = engine();
    let _ticker = Ticker::start(&engine, Duration::from_millis(10));
    let mut random = 1u64;
    let (mut refused, mut replayed) = (0, 0);
    for _ in 0..300 {
        let mut file = latchwork_testbed::replay::header();
        for (kind, payload) in &whole {
            let mut payload = payload.clone();
            // One byte of every segment on average; components stay as they are.
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            if *kind == 2 && random >> 20 & 1 == 1 {
                let at = (random >> 33) as usize % payload.len();
                payload[at] ^= 1 << (random >> 24 & 7);
            }
            file.extend(chunk(*kind, &payload));
        }
        std::fs::write(&path, file).expect("written");
        let recording = match Recording::open(&path) {
            Ok(recording) => recording,
            Err(error) => {
                assert!(error.to_string().contains("the chunk at byte"), "{error}");
                continue;
            }
        };
        let place = format!("{}: the chunk at byte ", path.display());
        assert!(recording.damage.iter().all(|d| d.starts_with(&place)), "{:#?}", recording.damage);
        refused += recording.damage.len();
        for run in recording.runs() {
            for (block, _) in recording.blocks(run) {
                let options = Options::default();
                match replay(&recording, &engine, run, block, &options) {
                    Ok(told) => replayed += told.executions,
                    Err(error) => assert!(error.to_string().contains(&format!("`{block}`")), "{error}"),
                }
                let _ = export(&recording, &engine, run, block, &options);
            }
        }
    }
    assert!(refused > 100 && replayed > 1000, "{refused} segments refused, {replayed} executions replayed");
}

#[test]
fn no_damage_makes_a_replay_panic() {
    let (_folder, path) = recorded();
    let recording = Recording::open(&path).expect("a recording");
    let whole = recording.to_bytes();
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("x.latchrec");
    let mut random = 1u64;
    for _ in 0..60 {
        let mut bytes = whole.clone();
        for _ in 0..4 {
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let at = (random >> 33) as usize % bytes.len();
            bytes[at] ^= 1 << (random & 7);
        }
        std::fs::write(&file, bytes).expect("written");
        if let Ok(recording) = Recording::open(&file) {
            for (block, _) in recording.blocks(1) {
                let _ = replay(&recording, &engine(), 1, block, &Options::default());
            }
        }
    }
}

#[test]
fn what_is_no_recording_is_refused_with_a_sentence() {
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("plant.toml");
    std::fs::write(&file, "[plant]\n").expect("written");
    let error = Recording::open(&file).expect_err("it is none").to_string();
    assert!(error.contains("is no recording: it does not begin with LATCHREC"), "{error}");
    let empty = TempDir::new().expect("a folder");
    let error = Recording::open(empty.path()).expect_err("it is empty").to_string();
    assert!(error.contains("holds no recorded block"), "{error}");
    std::fs::write(&file, b"LATCHREC\x09\0\0\0").expect("written");
    let error = Recording::open(&file).expect_err("another version").to_string();
    assert!(error.contains("has version 9 of the format"), "{error}");
}

/// A plant whose one recorded block has other outputs in every scan.
fn busy(limits: &str) -> String {
    format!(
        "[recorder]\nblocks = [\"t\"]\nkeyframe = \"1s\"\n{limits}\n[lane.main]\nevery = \"1ms\"\n[block.t]\n\
         component = \"ton\"\nlane = \"main\"\ninputs.in = true\ninputs.pt = \"10h\"\n"
    )
}

fn length(folder: &Path) -> u64 {
    let files = std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry"));
    let segments = files.filter(|e| e.path().extension().is_some_and(|e| e == "latchrec"));
    segments.map(|e| e.metadata().expect("its length").len()).sum()
}

#[test]
fn files_never_take_more_than_their_room_and_keep_the_newest() {
    let folder = TempDir::new().expect("a folder");
    let duration = 600 * SECOND;
    run(Rig::new(&busy("spill = \"1MiB\"")).trace(None).plant(Time::Virtual), Some(folder.path()), "", duration);
    let kept = length(folder.path());
    assert!(kept <= 1 << 20, "{kept}");
    assert!(kept > 3 << 18, "room is used: {kept}");
    let recording = Recording::open(folder.path()).expect("a recording");
    let replayed = again(&recording, "t", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!(replayed.to, duration - 1_000_000);
    assert!(replayed.from > 0, "the oldest are gone");
}

#[test]
fn the_ring_in_memory_never_takes_more_than_its_memory() {
    let mut plant = Rig::new(&busy("memory = \"64KiB\"")).trace(None).plant(Time::Virtual);
    let component = plant.model.blocks[0].component.bytes().len();
    let console = plant.console();
    let asked = std::thread::spawn(move || {
        let operator = Operator { user: "u".into(), origin: "cli".into(), reason: String::new() };
        let ask = |operation| console.ask(operator.clone(), operation, None, Duration::from_secs(60));
        let mut lengths = Vec::new();
        // Until the plant has ended.
        while let Ok(Answer::Recording(bytes)) = ask(Operation::Recording) {
            lengths.push(bytes.len());
        }
        lengths
    });
    let options = RunOptions { scans: Some(120_000), ..RunOptions::default() };
    run_virtual(plant, &options, &AtomicBool::new(false), &mut Watch::default());
    let lengths = asked.join().expect("it has not panicked");
    let most = (64 << 10) + component + 1000;
    assert!(lengths.iter().all(|n| *n <= most), "{lengths:?}");
    assert!(lengths.iter().any(|n| *n > most / 2), "the memory is used: {lengths:?}");
}

#[test]
fn each_run_into_the_same_folder_is_a_run_of_its_own() {
    let folder = TempDir::new().expect("a folder");
    for _ in 0..2 {
        run(Rig::new(PLANT).plant(Time::Virtual), Some(folder.path()), STIMULUS, SECOND);
    }
    let recording = Recording::open(folder.path()).expect("a recording");
    assert_eq!(recording.runs(), [1, 2]);
    let replayed = again(&recording, "count", &Options::default());
    assert!(replayed.equal());
    assert_eq!((replayed.run, replayed.executions), (2, 100));
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error_at_the_start_and_none_without_a_recorder() {
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("written");
    assert!(Rig::new(PLANT).plant(Time::Virtual).record_into(&file).is_err());
    let without = PLANT.replacen("[recorder]\nblocks = [\"unit\", \"count\"]\nkeyframe = \"500ms\"\n", "", 1);
    assert!(Rig::new(&without).plant(Time::Virtual).record_into(&file).is_ok());
}

#[test]
fn recording_changes_nothing_of_what_the_plant_does() {
    let without = PLANT.replacen("[recorder]\nblocks = [\"unit\", \"count\"]\nkeyframe = \"500ms\"\n", "", 1);
    let ran = |text: &str| Rig::new(text).stimulus(STIMULUS).run_for(3 * SECOND);
    let (with, without) = (ran(PLANT), ran(&without));
    assert_eq!(with.trace, without.trace);
    assert_eq!(with.records, without.records);
    assert!(with.told(Kind::Lost).is_empty());
}

#[test]
fn recorded_time_becomes_a_component_test() {
    let (_folder, path) = recorded();
    let recording = Recording::open(&path).expect("a recording");
    let engine = engine();
    let _ticker = Ticker::start(&engine, Duration::from_millis(10));
    let options = Options { to: 2 * SECOND, ..Options::default() };
    let exported = export(&recording, &engine, 1, "count", &options).expect("a test");
    assert_eq!(exported.executions, 201);
    assert!(exported.steps < 120, "only where something changed: {}", exported.steps);
    let text: Vec<_> = exported.text.lines().take(32).collect();
    insta::assert_snapshot!(text.join("\n"));
}

/// A counter that is recorded, after a run with these rows of the stimulus.
fn swapped(versions: [&Counter; 2], rows: &str, keyframe: &str, duration: u64) -> (Vec<Record>, Recording) {
    let text = format!(
        "[recorder]\nblocks = [\"n\"]\nkeyframe = \"{keyframe}\"\n[lane.main]\nevery = \"10ms\"\n\
         [block.n]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n"
    );
    let rig = Rig::new(&text).with("v1", &versions[0].component()).with("v2", &versions[1].component());
    let folder = TempDir::new().expect("a temporary folder");
    let records = run(rig.plant(Time::Virtual), Some(folder.path()), rows, duration);
    (records, Recording::open(folder.path()).expect("a recording"))
}

#[test]
fn the_first_execution_of_a_version_that_comes_with_a_swap_is_recorded_too() {
    let versions = [&Counter::new(1), &Counter::new(2).bad(Bad::Trap(31))];
    let (_, recording) = swapped(versions, "1s,swap.n,v2.wasm probation=5\n", "10s", 2 * SECOND);
    let replayed = again(&recording, "n", &Options::default());
    // The trap is at the 31st execution of the instance: it happens again only if none before it is missing.
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!((replayed.skipped, replayed.missed), (0, 0));
    assert_eq!(replayed.notes, Vec::<String>::new());
    let (_, segments) = recording.blocks(1).next().expect("a block");
    let second = segments.iter().find(|s| s.head.hash != segments[0].head.hash).expect("segments of the new version");
    assert_eq!((second.head.from, &second.head.start), (SECOND, &Start::State(vec![100])));
}

#[test]
fn a_version_that_comes_back_from_a_roll_back_is_replayed_as_it_stood() {
    // The one that waits remembers what it does not retain, too.
    for retained in [None, Some("u32")] {
        let versions =
            [&Counter { retained, ..Counter::new(1) }, &Counter { retained, ..Counter::new(2) }.bad(Bad::Trap(31))];
        let rows = "1s,swap.n,v2.wasm probation=100\n1.1s,n.settings.step,3\n";
        let (records, recording) = swapped(versions, rows, "10s", 2 * SECOND);
        assert!(records.iter().any(|r| r.kind == Kind::Swap && r.transition == "rolled-back"), "{records:#?}");
        let replayed = again(&recording, "n", &Options::default());
        assert!(replayed.equal(), "{replayed:#?}");
        // 100, then 31 of the other one, the last of which failed and was executed again by the one before: 70.
        assert_eq!((replayed.executions, replayed.skipped, replayed.missed), (201, 0, 0), "{replayed:#?}");
        assert_eq!(replayed.notes, Vec::<String>::new());
        assert_eq!((replayed.from, replayed.to), (0, 2 * SECOND - 10_000_000));
    }
}

#[test]
fn a_version_is_replayed_across_a_swap_to_the_very_same_component() {
    let versions = [&Counter::new(1), &Counter::new(1)];
    let (_, recording) = swapped(versions, "1s,swap.n,v2.wasm probation=5\n", "300ms", 2 * SECOND);
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!((replayed.executions, replayed.skipped), (200, 0));
}

#[test]
fn a_block_whose_state_cannot_be_saved_is_not_put_out_of_order_by_the_recorder() {
    let versions = [&Counter::new(1).bad(Bad::Save), &Counter::new(2)];
    let (records, recording) = swapped(versions, "", "100ms", 2 * SECOND);
    let faults = records.iter().filter(|r| r.kind == Kind::Fault && r.source == "n").count();
    let fault = |r: &&Record| r.kind == Kind::Fault && r.source == "n" && r.transition == "trap";
    assert!(records.iter().filter(fault).count() <= 1, "asked once at most: {faults} {records:#?}");
    assert!(!records.iter().any(|r| r.transition == "parked"), "{records:#?}");
    assert!(executions(&recording, "n") > 150);
}
