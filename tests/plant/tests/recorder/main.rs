//! The flight recorder of a plant, and replays of what it has recorded.

mod damage;
mod equal;
mod faults;
mod files;
mod other;
mod states;
mod swaps;

use latchwork_block::{Engine, FaultKind, Ticker};
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::Change;
use latchwork_plant::operate::{Answer, Operation, Operator};
use latchwork_plant::run::{Control, Observer, RunOptions, resolve_stimulus, run_virtual};
use latchwork_record::{Kept, Kind, Record};
use latchwork_testbed::replay::{
    Event, Head, Options, Recording, Replayed, Segment, Start, Tolerances, Writer, component_chunk, export, header,
    replay, segment_chunk,
};
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

/// The segments of the last run's only recorded block.
fn segments(recording: &Recording) -> &[Segment] {
    recording.blocks(last_run(recording)).next().expect("a block").1
}

/// All that has happened in segments, one after the other.
fn each_event(segments: &[Segment], mut look: impl FnMut(Event<'_>)) {
    for segment in segments {
        let mut events = segment.events();
        while let Some(event) = events.next_event().expect("whole") {
            look(event);
        }
    }
}

/// A recording in one file, with the component of its segments from another one.
fn written<'a>(of: &Recording, segments: impl IntoIterator<Item = &'a Segment>) -> (TempDir, Recording) {
    let (mut bytes, mut of_component) = (header(), None);
    for segment in segments {
        if of_component.is_none() {
            bytes.extend(component_chunk(of.component(&segment.head.hash).expect("its component")));
            of_component = Some(&segment.head.hash);
        }
        bytes.extend(segment_chunk(segment));
    }
    opened(&bytes)
}

/// A recording in one file.
fn opened(bytes: &[u8]) -> (TempDir, Recording) {
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("x.latchrec");
    std::fs::write(&file, bytes).expect("written");
    let recording = Recording::open(&file).expect("a recording");
    (folder, recording)
}

/// The same segment with other events; the first one of a recording is number 0, and `n` counts on.
fn rewritten(
    segment: &Segment,
    n: &mut usize,
    mut change: impl for<'a> FnMut(usize, Event<'a>) -> Event<'a>,
) -> Segment {
    let mut writer = Writer::new(Head { executions: 0, missed: 0, ..segment.head.clone() });
    each_event(std::slice::from_ref(segment), |event| {
        writer.add(change(*n, event));
        *n += 1;
    });
    writer.cut(Start::Continued).expect("not empty")
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
