//! Nothing allocates while a lane runs: counted.

use crate::bench::{Lane, number, point};
use crate::chip::Chip;
use crate::{Outcome, ensure};
use latchwork_io::direct::Role;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, counted by thread.
struct Counting;

// SAFETY: every call goes on to the system's allocator unchanged; the counter is a plain cell without a destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`, and all memory comes from the system's allocator.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations during `f`.
fn counted(f: impl FnOnce()) -> u64 {
    let before = COUNT.with(Cell::get);
    f();
    COUNT.with(Cell::get) - before
}

pub(crate) fn lane() -> Outcome {
    ensure!(counted(|| drop(std::hint::black_box(Box::new(7)))) == 1, "the counter does not count");
    let chip = Chip::new("alloc", 8, &[])?;
    let points = (0..8).map(|n| {
        let (safe, role) = match n {
            0..3 => (None, Role::Edge),
            3..5 => (None, Role::Level),
            _ => (Some(false), Role::Output),
        };
        (point(&format!("p{n}"), &[("line", number(n))], safe), role)
    });
    let mut lane = Lane::healthy(&chip, points.collect())?;
    let (mut edges, mut allocations, mut wrong) = (0, 0, 0);
    for round in 0..500_u64 {
        (0..4).for_each(|line| chip.pull(line, round % 2 == 0));
        let direct = &mut lane.direct;
        let mut report = |_| wrong += 1;
        // From the very first round: the driver keeps nothing back to be made later.
        allocations += counted(|| {
            for point in 0..3 {
                assert!(direct.descriptor(point).is_some());
                while direct.edges(point, &mut |e| edges += 1 + e.missed, &mut report) {}
            }
            for point in 0..5 {
                std::hint::black_box(direct.level(point, &mut report));
            }
            direct.write(&[round & 1, round >> 1 & 1, round >> 2 & 1], &mut report);
        });
    }
    ensure!(edges == 1500 && wrong == 0, "{edges} edges of 1500, {wrong} events");
    ensure!(allocations == 0, "{allocations} allocations in 500 rounds");
    Ok(())
}
