//! A lane's steady scan allocates nothing: proved by counting.
//!
//! Allocations are counted by thread, so that the tests do not count each other's.

use latchwork_plant::assemble::Time;
use latchwork_plant::lane::{Request, TapSlot, on_tape, tap, tape};
use latchwork_tests_plant::Rig;
use latchwork_tests_plant::forge::Counter;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is handed on to the system's allocator unchanged; counting touches a thread-local that needs no
// allocation and no destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        // SAFETY: as promised by our caller.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, ptr: *mut u8, layout: Layout) {
        COUNT.with(|c| c.set(c.get() + 1));
        // SAFETY: as promised by our caller.
        unsafe { System.dealloc(ptr, layout) }
    }
    unsafe fn realloc(&self, ptr: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        // SAFETY: as promised by our caller.
        unsafe { System.realloc(ptr, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const PLANT: &str = r#"
[lane.main]
every = "10ms"
[lane.slow]
every = "20ms"
[driver.field]
kind = "sim"
[driver.field.points]
level = { type = "u16" }
door = { type = "bool" }
[block.clock]
component = "multivibrator"
lane = "main"
inputs.run = true
settings.on-time = "50ms"
settings.off-time = "50ms"
[block.count]
component = "ctu"
lane = "main"
inputs.cu = { tag = "clock.outputs.out", not = true }
inputs.pv = 1000
[block.unit]
component = "alarm-unit"
lane = "main"
inputs.level = "field.level"
inputs.door = "clock.outputs.out"
settings.veracity-time = "20ms"
[block.watch]
component = "bounds-check"
lane = "slow"
inputs.signal = 55.0
[block.user]
component = "everything"
lane = "slow"
[block.delay]
component = "ton"
lane = "slow"
inputs.in = "unit.alarms.door"
inputs.pt = "10ms"
[[alarm]]
match = "clock.outputs.out"
code = 0xC400
suppress-when = "delay.outputs.q"
"#;

#[test]
fn ten_thousand_scans_with_changing_values_alarms_and_a_trace_allocate_nothing() {
    let mut plant = Rig::new(PLANT).plant(Time::Virtual);
    let mut now = 0;
    // Alarm records and trace rows leave through bounded queues, which nobody empties here: full queues must cost no
    // allocation either.
    let mut scans = |n: u64| {
        for _ in 0..n {
            now += 10_000_000;
            for lane in &mut plant.lanes {
                let begun = now;
                lane.scan(now, now, || begun + 1000);
            }
        }
    };
    scans(100);
    let before = COUNT.with(Cell::get);
    scans(10_000);
    let allocations = COUNT.with(Cell::get) - before;
    assert_eq!(allocations, 0);
    assert_eq!(plant.lanes[0].statistics().scans, 10_100);
    assert_eq!(plant.lanes[0].statistics().faults, 0);
}

#[test]
fn taps_of_every_block_allocate_nothing_whether_they_are_read_or_full() {
    let mut plant = Rig::new(PLANT).plant(Time::Virtual);
    let mut readers = Vec::new();
    for lane in 0..plant.lanes.len() {
        let (tape, reader) = tape(1 << 14);
        plant.lanes[lane].record_on(tape);
        readers.push((TapSlot::Recorder, reader));
        for place in 0..plant.layout.lanes[lane].blocks.len() {
            let class = &plant.model.blocks[plant.layout.lanes[lane].blocks[place].block].class;
            let (own, reader) = tap(class, 16, None);
            readers.push((TapSlot::Shadow, reader));
            for (slot, tap) in [(TapSlot::Recorder, on_tape(class, place as u32).0), (TapSlot::Shadow, own)] {
                let request = Request::Tap { block: place as u32, slot, tap };
                assert!(plant.supervisor.send(lane, request).is_ok());
            }
        }
    }
    let (mut now, mut frames) = (0, 0);
    let mut scans = |n: u64| {
        for _ in 0..n {
            now += 10_000_000;
            for lane in &mut plant.lanes {
                let begun = now;
                lane.scan(now, now, || begun + 1000);
            }
            // Nobody reads for the shadow: those rings are full.
            for (_, reader) in readers.iter_mut().filter(|(slot, _)| *slot == TapSlot::Recorder) {
                while reader.next_frame().is_some() {
                    frames += 1;
                }
            }
        }
        frames
    };
    let first = scans(100);
    let before = COUNT.with(Cell::get);
    let last = scans(5_000);
    assert_eq!(COUNT.with(Cell::get) - before, 0);
    assert!(last - first >= 30_000, "six blocks and more: {}", last - first);
}

const INTERRUPTS: &str = r#"
[lane.main]
every = "10ms"
[lane.trip]
on = ["gpio.door", "gpio.beam"]
also-with = "main"
storm-limit = 1000
[driver.gpio]
kind = "sim"
points.door = { type = "bool" }
points.beam = { type = "bool" }
points.dump = { type = "bool", from = "fast.outputs.trip" }
[block.fast]
component = "interlock-probe"
lane = "trip"
inputs = { a = "gpio.door", b = "gpio.beam" }
[block.slow]
component = "interlock-probe"
lane = "main"
inputs.b = "fast.outputs.b"
"#;

#[test]
fn edges_ticks_storms_and_their_records_allocate_nothing() {
    let mut plant = Rig::new(INTERRUPTS).plant(Time::Virtual);
    let rows = "time,tag,value\n0s,gpio.door,true\n0s,gpio.beam,true\n0s,gpio.door,false\n0s,gpio.beam,false\n";
    let rows = latchwork_io::stimulus::read(rows.as_bytes()).expect("a right stimulus");
    let stimulus = latchwork_plant::run::resolve_stimulus(&plant, &rows).expect("a stimulus that fits");
    let (mut now, mut handled) = (0, 0u64);
    plant.lanes[1].begin_interrupts(0);
    let mut edges = |n: usize, step: u64| {
        for i in 0..n {
            now += step;
            plant.stimulate(&stimulus[i % 4].action, now);
            if i % 16 == 0 {
                plant.lanes[0].scan(now, now, || now + 1000);
            }
            let lane = &mut plant.lanes[1];
            lane.collect();
            lane.calm(now);
            while let Some(arrival) = lane.next_arrival(u64::MAX) {
                handled += 1;
                lane.activate(arrival, now, || now + 1000);
            }
        }
        (COUNT.with(Cell::get), handled)
    };
    edges(1000, 2_000_000);
    let (before, first) = edges(1, 2_000_000);
    let (after, last) = edges(10_000, 2_000_000);
    assert_eq!(after - before, 0, "edges within the limit");
    assert!(last - first >= 10_000, "{first} to {last}");
    let (after_storm, of_storm) = edges(10_000, 20_000);
    assert_eq!(after_storm - after, 0, "a storm");
    assert!(of_storm - last < 2000, "the storm was limited: {} executions", of_storm - last);
}

#[test]
fn an_exchange_its_probation_and_its_end_allocate_nothing_in_the_lane() {
    let v1 = Counter::new(1);
    let v2 = Counter { retained: Some("u64"), ..Counter::new(2) };
    let v3 = Counter { double: true, elapsed: false, inputs: &[("more", "f64")], ..Counter::new(3) };
    let rig = Rig::new(
        "[lane.main]\nevery = \"10ms\"\n[block.count]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n\
         [block.other]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n",
    );
    // Its folder stays while orders read from it.
    let rig = rig.with("v1", &v1.component()).with("v2", &v2.component()).with("v3", &v3.component());
    let mut plant = rig.plant(Time::Virtual);
    let mut now = 0;
    let mut act = |plant: &mut latchwork_plant::assemble::Plant, row: &str, scans: u64| {
        if !row.is_empty() {
            let rows = latchwork_io::stimulus::read(format!("time,tag,value\n0s,{row}\n").as_bytes()).expect("a row");
            let rows = latchwork_plant::run::resolve_stimulus(plant, &rows).expect("a row that fits");
            plant.stimulate(&rows[0].action, now);
        }
        let mut allocations = 0;
        for _ in 0..scans {
            now += 10_000_000;
            plant.serve(now);
            plant.supervisor.pump();
            let before = COUNT.with(Cell::get);
            plant.lanes[0].scan(now, now, || now + 1000);
            allocations += COUNT.with(Cell::get) - before;
        }
        plant.serve(now);
        let running: Vec<_> = plant.lanes[0].blocks_mut().iter().map(|b| b.rest.version).collect();
        (allocations, running)
    };
    assert_eq!(act(&mut plant, "", 100).1, [0, 0]);
    assert_eq!(act(&mut plant, "swap.count,v2.wasm other v2.wasm probation=50", 100), (0, vec![1, 2]), "to its end");
    assert_eq!(
        act(&mut plant, "swap.count,v1.wasm other v1.wasm probation=50 allow-lossy", 20),
        (0, vec![3, 4]),
        "on probation"
    );
    assert_eq!(act(&mut plant, "rollback.count,1", 20), (0, vec![1, 2]), "taken back");
    assert_eq!(act(&mut plant, "rollback.count,2", 20), (0, vec![5, 2]), "an earlier version");
    assert_eq!(act(&mut plant, "", 1000), (0, vec![5, 2]), "steady again");
    assert_eq!(act(&mut plant, "swap.count,v3.wasm probation=50", 40), (0, vec![6, 2]), "with other ports");
    assert_eq!(act(&mut plant, "rollback.count,1", 1000), (0, vec![5, 2]), "without them");
    assert_eq!(act(&mut plant, "swap.count,v3.wasm probation=50", 1000), (0, vec![7, 2]), "with them for good");
}

const RETAINED: &str = r#"
[lane.main]
every = "10ms"
[lane.trip]
on = ["gpio.door"]
[driver.gpio]
kind = "sim"
points.door = { type = "bool" }
[block.a]
component = "keeper-probe"
lane = "main"
retain = true
inputs.count = true
[block.b]
component = "pco"
lane = "main"
retain = true
[block.edges]
component = "keeper-probe"
lane = "trip"
retain = true
"#;

#[test]
fn saving_states_between_scans_allocates_nothing_in_the_lane() {
    use latchwork_plant::lane::{Report, Request, Save, SaveResult};
    let mut plant = Rig::new(RETAINED).plant(Time::Virtual);
    let fields = |block: usize| plant.model.blocks[block].class.retained.len();
    // Lane, index in it, and the cells that go to the lane and come back.
    let mut saves: Vec<_> = [(0, 0, 0), (0, 1, 1), (1, 0, 2)]
        .map(|(lane, block, model)| (lane, block, Some(vec![0u64; fields(model)].into_boxed_slice())))
        .into();
    let mut now = 0;
    plant.lanes[1].begin_interrupts(0);
    let mut round = |saved: &mut u64| {
        for (lane, block, place) in &mut saves {
            let cells = place.take().expect("the cells came back");
            let sent = plant.supervisor.send(*lane, Request::Save(Save { block: *block, version: 0, cells }));
            assert!(sent.is_ok());
            now += 10_000_000;
            plant.lanes[0].scan(now, now, || now + 1000);
            if let Some(arrival) = plant.lanes[1].next_arrival(u64::MAX) {
                plant.lanes[1].activate(arrival, now, || now + 1000);
            }
            for lane in &mut plant.lanes {
                lane.spare(now + 10_000_000, || now + 2000);
            }
            let Ok(Report::Saved(answer)) = plant.supervisor.lanes[*lane].reports.pop() else { panic!("no answer") };
            *saved += u64::from(answer.result == SaveResult::Saved);
            *place = Some(answer.save.cells);
        }
    };
    let mut saved = 0;
    (0..10).for_each(|_| round(&mut saved));
    let before = COUNT.with(Cell::get);
    (0..1000).for_each(|_| round(&mut saved));
    assert_eq!(COUNT.with(Cell::get) - before, 0);
    assert_eq!(saved, 3 * 1010);
}
