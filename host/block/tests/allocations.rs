//! A steady execution on the plain path allocates nothing: counted by the allocator of this test binary.

mod support;

use latchwork_block::Scan;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use support::class::{Leaf, Spec, Ty};
use support::component::generated;
use support::evil::{Evil, When};
use support::strategy::Cells;
use support::twins::{patient, templates};

/// The system's allocator; counts per thread, so that a ticker or another test does not disturb.
struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // While a thread ends its count is gone, and nobody asks for it.
    let _ = COUNT.try_with(|c| c.set(c.get() + 1));
}

// SAFETY: every call goes to the system's allocator unchanged; counting neither allocates nor unwinds.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's obligations are those of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, p: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: as above.
        unsafe { System.realloc(p, layout, size) }
    }

    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(p, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const CALLS: u64 = 10_000;

/// Allocations of `CALLS` executions on each path, after some that warm up.
fn allocations(spec: &Spec) -> [u64; 2] {
    let templates = templates(&generated(spec, Evil::None, When(0)));
    templates.map(|template| {
        let mut instance = template.instantiate(&patient()).unwrap();
        let arguments = spec.argument_leaves();
        let n = arguments.len();
        let ins: Vec<u32> = (0..n as u32).collect();
        let mut cells = vec![0; n + spec.result_leaves().len()];
        let mut values = Cells::new(5);
        let mut execute = |now: u64| {
            for (cell, leaf) in cells.iter_mut().zip(&arguments) {
                *cell = leaf.value(values.bits());
            }
            instance.execute(Scan { now, elapsed: 1, first: false }, &ins, n as u32, &mut cells).unwrap();
            assert!(!instance.has_log());
        };
        (0..10).for_each(&mut execute);
        let before = COUNT.get();
        (10..10 + CALLS).for_each(&mut execute);
        let counted = COUNT.get() - before;
        // The component path promises nothing; its figure is for the reader of the output.
        println!("{:?} path: {counted} allocations in {CALLS} calls", template.path());
        counted
    })
}

/// Allocations of `CALLS` times saving into cells that are there and restoring them.
fn allocations_of_state(spec: &Spec) -> u64 {
    let [_, plain] = templates(&generated(spec, Evil::None, When(0)));
    let [mut old, mut new] = [(); 2].map(|()| plain.instantiate(&patient()).unwrap());
    let leaves = spec.retained_leaves();
    let (mut values, mut saved) = (Cells::new(7), vec![0; leaves.len()]);
    let mut state = values.of(&leaves);
    let mut swap = |n: u64| {
        for (cell, leaf) in state.iter_mut().zip(&leaves) {
            *cell = leaf.value(values.bits() ^ n);
        }
        old.restore(&state).unwrap();
        assert!(old.save_into(&mut saved).unwrap());
        new.restore(&saved).unwrap();
        assert!(new.save_into(&mut saved).unwrap());
        assert_eq!(saved, state);
    };
    (0..10).for_each(&mut swap);
    let before = COUNT.get();
    (10..10 + CALLS).for_each(&mut swap);
    COUNT.get() - before
}

/// A swap does both between two scans.
#[test]
fn saving_and_restoring() {
    let leaf = |leaf| vec![Ty::Leaf(leaf)];
    for (retained, post_return) in [
        (leaf(Leaf::U32), false),
        (leaf(Leaf::F64), true),
        (vec![Ty::Leaf(Leaf::U8), Ty::Duration, Ty::Leaf(Leaf::Enum(3)), Ty::RealSignal], false),
        (vec![Ty::RealSignal; 20], true),
    ] {
        let spec = Spec { outputs: leaf(Leaf::Bool), retained, post_return, ..Spec::default() };
        assert_eq!(allocations_of_state(&spec), 0, "{:?}", spec.retained);
    }
}

#[test]
fn the_allocator_counts() {
    let before = COUNT.get();
    drop(std::hint::black_box(vec![1u8; 100]));
    assert_eq!(COUNT.get() - before, 1);
}

#[test]
fn flat_parameters() {
    let spec = Spec {
        inputs: vec![Ty::Leaf(Leaf::F64), Ty::RealSignal, Ty::Leaf(Leaf::Bool), Ty::Duration],
        outputs: vec![Ty::Leaf(Leaf::Bool), Ty::RealSignal, Ty::Leaf(Leaf::U16)],
        commands: 3,
        alarms: 4,
        ..Spec::default()
    };
    assert_eq!(allocations(&spec)[1], 0);
}

#[test]
fn parameters_in_memory() {
    let spec = Spec {
        inputs: vec![Ty::RealSignal; 12],
        outputs: vec![Ty::RealSignal; 12],
        commands: 32,
        alarms: 32,
        post_return: true,
        ..Spec::default()
    };
    assert_eq!(allocations(&spec)[1], 0);
}

#[test]
fn one_flat_result() {
    let spec = Spec { inputs: vec![Ty::Leaf(Leaf::F32)], outputs: vec![Ty::Leaf(Leaf::F64)], ..Spec::default() };
    assert_eq!(allocations(&spec)[1], 0);
}
