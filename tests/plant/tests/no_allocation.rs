//! A lane's steady scan allocates nothing: proved by counting.
//!
//! One test in a program of its own: another test's allocations would be counted too.

use latchwork_plant::assemble::Time;
use latchwork_tests_plant::Rig;
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
