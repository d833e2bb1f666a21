//! The drivers and the fast-interlock example on the kernel's GPIO subsystem.
//!
//! One test after the other: each machine wants a processor for itself.

use latchwork_tests_gpio_vm::{Files, program, project, run_checks, target};
use std::sync::Mutex;

static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

#[test]
fn the_gpio_driver() {
    let _turn = ONE_AT_A_TIME.lock();
    run_checks(&Files::new().with(&program("gpio-probe")), &["./gpio-probe"]);
}

#[test]
fn the_rppal_driver() {
    let _turn = ONE_AT_A_TIME.lock();
    run_checks(&Files::new().with(&program("rppal-probe")), &["./rppal-probe"]);
}

#[test]
fn the_fast_interlock_example() {
    let _turn = ONE_AT_A_TIME.lock();
    let files = Files::new()
        .with(&program("latchwork"))
        .with(&program("gpio-field"))
        .with(&target().join("components"))
        .with(&project().join("examples/fast-interlock"));
    run_checks(&files, &["./gpio-field"]);
}
