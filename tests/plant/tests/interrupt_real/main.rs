//! Interrupt lanes and the hardware watchdog by the machine's clock, on threads of their own. Nothing here asserts how long
//! anything takes.

mod lines;

use latchwork_plant::assemble::Time;
use latchwork_plant::lane::{Change, LaneState};
use latchwork_plant::run::{Control, MachineClock, Observer, Outcome, RunOptions, resolve_stimulus, run_real};
use latchwork_record::{Kind, Record};
use latchwork_tests_plant::Rig;
use std::io::Read;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

const MS: u64 = 1_000_000;

/// One plant at a time: real-time threads of one test must not hold up those of another.
fn alone() -> MutexGuard<'static, ()> {
    static RUNNING: Mutex<()> = Mutex::new(());
    // A test that failed has nothing more to say about the next one.
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Default)]
struct Log(Vec<Record>);

impl Observer for Log {
    fn record(&mut self, record: &Record, _: &[latchwork_record::Kept]) {
        self.0.push(record.clone());
    }
    fn change(&mut self, _: &Change) {}
    fn tick(&mut self, _: u64) -> Control {
        Control::Continue
    }
}

fn run(rig: &Rig, ms: u64, rows: &str) -> (Outcome, Vec<Record>) {
    let _alone = alone();
    let plant = rig.plant(Time::Real);
    let rows = latchwork_io::stimulus::read(format!("time,tag,value\n{rows}").as_bytes()).expect("a right stimulus");
    let stimulus = resolve_stimulus(&plant, &rows).expect("a stimulus that fits");
    let options = RunOptions { duration: Some(ms * MS), stimulus, ..RunOptions::default() };
    let mut log = Log::default();
    let outcome = run_real(plant, &options, Arc::new(MachineClock::start()), &Arc::default(), &mut log);
    (outcome, log.0)
}

fn edges<'a>(records: &'a [Record], source: &str) -> Vec<&'a Record> {
    records.iter().filter(|r| r.kind == Kind::Event && r.source == source).collect()
}

const PLANT: &str = r#"
[lane.main]
every = "2ms"
watchdog = "10s"
[lane.trip]
on = ["gpio.door", "gpio.beam"]
also-with = "main"
watchdog = "10s"
[lane.poll]
on = ["gpio.level"]
poll = "1ms"
watchdog = "10s"
[driver.gpio]
kind = "sim"
points.door = { type = "bool" }
points.beam = { type = "bool" }
points.level = { type = "bool" }
[block.fast]
component = "interlock-probe"
lane = "trip"
budget = "1s"
inputs = { a = "gpio.door", b = "gpio.beam" }
[block.slow]
component = "interlock-probe"
lane = "main"
budget = "1s"
inputs.b = "fast.outputs.trip"
[block.polled]
component = "interlock-probe"
lane = "poll"
budget = "1s"
inputs.a = "gpio.level"
[sim.block.model]
component = "multivibrator"
lane = "main"
inputs.run = true
settings.on-time = "4ms"
settings.off-time = "4ms"
[sim.feed]
"gpio.beam" = "model.outputs.out"
"#;

#[test]
fn every_edge_of_stimulus_and_model_is_recorded_once_in_order() {
    let rows: String = (0..100).map(|n| format!("{}ms,gpio.door,{}\n", 20 + 3 * n, n % 2 == 0)).collect();
    let rig = Rig::new(PLANT).sim().trace(None);
    let (outcome, records) = run(&rig, 500, &format!("{rows}30ms,gpio.level,true\n"));
    assert!(outcome.lanes.iter().all(|l| l.state == LaneState::Stopped), "{:?}", outcome.lanes);
    let late = records.windows(2).find(|w| w[1].time < w[0].time);
    assert!(late.is_none(), "out of order: {late:?}");
    let lost: Vec<_> = records.iter().filter(|r| r.kind == Kind::Lost).collect();
    assert!(lost.is_empty(), "{lost:?}");

    let door = edges(&records, "gpio.door");
    assert_eq!(door.len(), 100);
    assert!(door.windows(2).all(|w| w[0].time < w[1].time && w[0].transition != w[1].transition));
    // The model feeds the beam: its edges alternate, and there are some.
    let beam = edges(&records, "gpio.beam");
    assert!(beam.len() > 4 && beam.windows(2).all(|w| w[0].transition != w[1].transition), "{}", beam.len());
    assert_eq!(edges(&records, "gpio.level").len(), 1);
    // At the start, for every edge and with every scan of main but perhaps the last.
    let [main, trip, _] = &outcome.lanes[..] else { panic!("three lanes") };
    let expected = 1 + door.len() as u64 + beam.len() as u64 + main.statistics.scans;
    assert!((expected - 1..=expected).contains(&trip.statistics.scans), "{expected} {}", trip.statistics.scans);
}

#[test]
fn records_leave_in_the_order_of_time_beside_long_scans() {
    // The block behind the load tells of its change long after the scan's start, whose time its record has.
    let text = PLANT.replace("every = \"2ms\"", "every = \"100ms\"")
        + "[block.load]\ncomponent = \"stress\"\nlane = \"main\"\nbudget = \"5s\"\ninputs.burn = 50000000\n\
           [block.behind]\ncomponent = \"interlock-probe\"\nlane = \"main\"\nbudget = \"5s\"\n\
           inputs.b = \"model.outputs.out\"\n";
    let text = text.replace("= \"4ms\"", "= \"80ms\"");
    let rows: String = (0..300).map(|n| format!("{}ms,gpio.door,{}\n", 20 + 3 * n, n % 2 == 0)).collect();
    let (_, records) = run(&Rig::new(&text).sim().trace(None), 1200, &rows);
    let late = records.windows(2).find(|w| w[1].time < w[0].time);
    assert!(late.is_none(), "out of order: {late:?}");
    assert_eq!(edges(&records, "gpio.door").len(), 300);
    assert!(!edges(&records, "behind.outputs.status").is_empty(), "the long scans have something to tell");
}

/// A plant with a watchdog that is a pipe; what was written to it.
fn watched(extra: &str, rows: &str) -> (Outcome, String) {
    let folder = tempfile::TempDir::new().expect("a folder");
    let path = folder.path().join("watchdog");
    rustix::fs::mknodat(rustix::fs::CWD, &path, rustix::fs::FileType::Fifo, 0o600.into(), 0).expect("a pipe");
    let mut pipe = std::fs::File::options().read(true).write(true).open(&path).expect("its end");
    let text = format!(
        "watchdog-device = \"{}\"\n[lane.main]\nevery = \"2ms\"\nwatchdog = \"5s\"\n[driver.x]\nkind = \"sim\"\n\
         points.fire = {{ type = \"bool\" }}\n\
         [block.b]\ncomponent = \"interlock-probe\"\nlane = \"main\"\nbudget = \"1s\"\ninputs.trap = \"x.fire\"\n{extra}",
        path.display()
    );
    let (outcome, _) = run(&Rig::new(&text).trace(None), 500, rows);
    // Ends the reading: the pipe's only writer is this test now.
    std::io::Write::write_all(&mut pipe, b".").expect("room");
    let mut written = Vec::new();
    let mut byte = [0];
    while pipe.read_exact(&mut byte).is_ok() && byte != *b"." {
        written.push(byte[0]);
    }
    (outcome, String::from_utf8(written).expect("letters"))
}

#[test]
fn the_main_lane_pets_the_watchdog_and_an_orderly_stop_disarms_it() {
    let (_, written) = watched("", "");
    assert!(written.starts_with('p') && written.ends_with('V'), "{written:?}");
    assert_eq!(written.matches('V').count(), 1);
}

#[test]
fn a_main_lane_that_faults_leaves_the_watchdog_armed() {
    let (outcome, written) = watched("on-fault = \"stop-lane\"\n", "100ms,x.fire,true\n");
    assert!(outcome.faulted());
    assert!(written.starts_with('p') && !written.contains('V'), "{written:?}");
}
