//! The flight recorder of a plant, and replays of what it has recorded.

use latchwork_block::{Engine, Ticker};
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::Change;
use latchwork_plant::run::{Control, Observer, RunOptions, resolve_stimulus, run_virtual};
use latchwork_record::{Kept, Kind, Record};
use latchwork_testbed::replay::{Event, Options, Recording, Replayed, Start, Tolerances, export, replay};
use latchwork_tests_plant::forge::Counter;
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
    stop_at: Option<u64>,
}

impl Observer for Watch {
    fn record(&mut self, record: &Record, _: &[Kept]) {
        self.records.push(record.clone());
    }
    fn change(&mut self, _: &Change) {}
    fn tick(&mut self, now: u64) -> Control {
        if self.stop_at.is_some_and(|at| now >= at) { Control::Stop } else { Control::Continue }
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
        let mut writer = latchwork_testbed::replay::Writer::new(segment.head.clone());
        let mut events = segment.events();
        let mut at = 0;
        while let Some(event) = events.next().expect("whole") {
            let Event::Execution { scan, arguments, outputs: Some(outputs) } = event else { continue };
            let mut outputs = outputs.to_vec();
            outputs[1] ^= u64::from(n == 1 && at == 7);
            writer.add(Event::Execution { scan, arguments, outputs: Some(&outputs) });
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
         [block.n]\ncomponent = \"counter\"\nlane = \"main\"\nsettings.step = 2\n"
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
        while let Some(event) = events.next().expect("whole") {
            settings += u64::from(matches!(event, Event::Settings { .. }));
        }
    }
    assert_eq!(settings, 1);
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
    let other = Counter::new(1).bad(latchwork_tests_plant::forge::Bad::Trap(31));
    let replayed = again(&recording, "n", &with(&engine, &other));
    let fault = replayed.fault.as_ref().expect("a fault");
    assert_eq!((fault.kind.as_str(), fault.at), ("trap", 300_000_000));
    assert_eq!(replayed.executions + replayed.skipped, 100);
    assert!(!replayed.equal());
}

#[test]
fn faults_and_restarts_are_replayed_too() {
    let (_folder, recording) = counter(&Counter::new(1).bad(latchwork_tests_plant::forge::Bad::Trap(31)), "10s");
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
    for block in ["count", "unit"] {
        let replayed = again(&recording, block, &Options::default());
        assert!(replayed.equal() && replayed.executions > 100, "{replayed:#?}");
    }
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
    plant.recording();
    let bytes = {
        // A run takes the plant; its recorder is asked in the middle.
        let (sender, receiver) = std::sync::mpsc::channel();
        latchwork_plant::run::run_virtual_with(
            plant,
            &RunOptions { scans: Some(60_000), ..RunOptions::default() },
            sender,
        );
        receiver.recv().expect("a recording")
    };
    assert!(bytes.len() <= (64 << 10) + component + 1000, "{}", bytes.len());
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
