//! The drivers and the fast-interlock example on the kernel's GPIO subsystem.
//!
//! At most two at a time: each machine wants a processor for itself. The longest has one, the others share the second.

use latchwork_tests_gpio_vm::{Files, program, project, run_checks, target};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A processor, numbered from 0; there is one at least.
fn processor(number: usize) -> MutexGuard<'static, ()> {
    static PROCESSORS: [Mutex<()>; 2] = [Mutex::new(()), Mutex::new(())];
    let there = std::thread::available_parallelism().map_or(1, usize::from);
    PROCESSORS[number % there.min(PROCESSORS.len())].lock().unwrap_or_else(PoisonError::into_inner)
}

#[test]
fn the_gpio_driver() {
    let _turn = processor(1);
    run_checks(&Files::new().with(&program("gpio-probe")), &["./gpio-probe"], 34);
}

#[test]
fn the_rppal_driver() {
    let _turn = processor(1);
    run_checks(&Files::new().with(&program("rppal-probe")), &["./rppal-probe"], 17);
}

fn example() -> Files {
    let field = Files::new().with(&program("latchwork")).with(&program("gpio-field"));
    field.with(&target().join("components")).with(&project().join("examples/fast-interlock"))
}

#[test]
fn the_fast_interlock_example() {
    let _turn = processor(0);
    let checks = [
        "ten-thousand-edges-once-each-in-order",
        "outputs-follow",
        "a-line-held-by-another",
        "SIGTERM-leaves-outputs-safe",
        "SIGINT-leaves-outputs-safe",
        "SIGHUP-leaves-outputs-safe",
        "SIGKILL-leaves-outputs-as-they-were",
    ];
    run_checks(&example(), &[&["./gpio-field"], &checks[..]].concat(), checks.len());
}

#[test]
fn a_chip_that_goes_away_and_comes_back() {
    let _turn = processor(1);
    run_checks(&example(), &["./gpio-field", "a-chip-that-goes-and-comes"], 1);
}
