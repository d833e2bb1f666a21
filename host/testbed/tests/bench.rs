//! The bench of Rust authors. Needs `cargo xtask guests`.

use latchwork_image::Quality;
use latchwork_testbed::{Bench, BenchError};

fn start(name: &str) -> Bench {
    Bench::component(name).and_then(|s| s.start()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_timer_runs_at_virtual_time() {
    let mut timer = start("ton");
    timer.set("in", true).set("pt", "2s").step();
    assert_eq!(timer.output("q"), false);
    timer.run("1.99s");
    assert_eq!(timer.output("q"), false);
    timer.step();
    assert_eq!(timer.output("q"), true);
    assert_eq!(timer.output("et"), "2s");
    assert_eq!(timer.now(), 2_000_000_000);
    let mut timer = timer.restarted().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(timer.step().output("q"), true, "it goes on after a restart");
}

#[test]
fn settings_and_a_restart() -> Result<(), BenchError> {
    let unit = Bench::component("bounds-check")?.setting("high-limit", 80.0)?.setting("hysteresis", 2)?;
    let mut unit = unit.every("1s")?.start()?;
    unit.set("signal", 81.5).step();
    assert_eq!(unit.output("high"), true);
    // Within the hysteresis, which outlives a restart.
    let mut unit = unit.restarted()?;
    assert_eq!(unit.set("signal", 79.0).step().output("high"), true);
    assert!(unit.configure("high-limit", 5.0)?.is_err(), "below the low limit");
    Ok(())
}

#[test]
fn a_signal_has_its_quality() {
    let mut check = start("analog-veracity");
    check.set("on", true).set_signal("signal", 3.0, Quality::Bad).step();
    let out = check.output("out");
    assert_eq!((out.quality, out == 0.0), (Quality::Bad, true));
    assert_eq!(out.to_string(), "0.0 bad");
}

#[test]
fn an_alarm_is_told_by_name() {
    let setup = Bench::class_of("defects", Some("test:defects/forgetful"));
    let mut edges = setup.and_then(|s| s.start()).unwrap_or_else(|e| panic!("{e}"));
    for _ in 0..3 {
        assert!(!edges.alarm("many"));
        edges.set("clk", false).step().set("clk", true).step();
    }
    assert!(edges.alarm("many"));
}

#[test]
fn a_command_lasts_for_one_step_and_a_fault_is_told() {
    let mut stress = start("stress");
    stress.command("nan").step();
    assert_eq!(stress.output("value").to_string(), "NaN");
    assert_eq!(stress.step().output("value"), 1);
    let fault = stress.command("trap").try_step().expect_err("a trap");
    assert!(fault.to_string().contains("trapped"), "{fault}");
}

#[test]
fn what_is_wrong_is_told_with_the_way_out() {
    let told = |result: Result<Bench, BenchError>| result.expect_err("an error").to_string();
    let missing = told(Bench::component("tno").and_then(|s| s.start()));
    assert!(missing.starts_with("there is no component \"tno\"; searched in "), "{missing}");
    let setup = || Bench::component("bounds-check");
    let errors = [
        told(setup().and_then(|s| s.setting("high-limt", 1.0)?.start())),
        told(setup().and_then(|s| s.setting("high-limit", "high")?.start())),
        told(setup().and_then(|s| s.setting("high-limit", f64::NAN)?.start())),
        told(setup().and_then(|s| s.every("10")?.start())),
        told(Bench::class_of("ton", Some("latchwork:device/tof")).and_then(|s| s.start()))
            .rsplit_once("ton.wasm: ")
            .expect("its path")
            .1
            .to_owned(),
    ];
    insta::assert_snapshot!("bench-errors", errors.join("\n"));
}

#[test]
#[should_panic = "there is no input `inn`; did you mean `in`?"]
fn an_unknown_input_is_a_panic_that_says_which_was_meant() {
    start("ton").set("inn", true);
}

#[test]
#[should_panic = "input `pt`: 2 is not a duration; expected a duration such as \"200ms\""]
fn a_value_of_another_type_is_a_panic_that_says_what_fits() {
    start("ton").set("pt", 2);
}
