//! The drivers and the fast-interlock example on the kernel's GPIO subsystem.
//!
//! One test after the other: each machine wants a processor for itself.

use latchwork_tests_gpio_vm::{Files, program, project, run_checks, target};
use std::sync::Mutex;

static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

#[test]
fn the_gpio_driver() {
    let _turn = ONE_AT_A_TIME.lock();
    run_checks(&Files::new().with(&program("gpio-probe")), &["./gpio-probe"], 29);
}

#[test]
fn the_rppal_driver() {
    let _turn = ONE_AT_A_TIME.lock();
    run_checks(&Files::new().with(&program("rppal-probe")), &["./rppal-probe"], 17);
}

fn example() -> Files {
    let field = Files::new().with(&program("latchwork")).with(&program("gpio-field"));
    field.with(&target().join("components")).with(&project().join("examples/fast-interlock"))
}

#[test]
fn the_fast_interlock_example() {
    let _turn = ONE_AT_A_TIME.lock();
    let checks = [
        "ten-thousand-edges-once-each-in-order",
        "outputs-follow",
        "a-line-held-by-another",
        "SIGTERM-leaves-outputs-safe",
        "SIGINT-leaves-outputs-safe",
        "SIGKILL-leaves-outputs-as-they-were",
    ];
    run_checks(&example(), &[&["./gpio-field"], &checks[..]].concat(), checks.len());
}

#[test]
fn a_chip_that_goes_away_and_comes_back() {
    let _turn = ONE_AT_A_TIME.lock();
    run_checks(&example(), &["./gpio-field", "a-chip-that-goes-and-comes"], 1);
}
