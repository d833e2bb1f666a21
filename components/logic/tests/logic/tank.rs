//! The tank model: balance of flows, Torricelli's law, limits, transmitter.

use crate::MS;
use latchwork_logic::{Tank, TankInputs, TankOutputs, TankSettings};

const REST: TankInputs = TankInputs { pump: false, drain: false, line_break: false, spike: false };
const PUMP: TankInputs = TankInputs { pump: true, ..REST };
const DRAIN: TankInputs = TankInputs { drain: true, ..REST };

/// Runs `seconds` with scans of 10 ms.
fn run(settings: &TankSettings, seconds: u64, inputs: TankInputs) -> TankOutputs {
    let mut tank = Tank::default();
    tank.execute(settings, 0, inputs);
    let mut out = TankOutputs::default();
    for _ in 0..seconds * 100 {
        out = tank.execute(settings, 10 * MS, inputs);
    }
    out
}

fn near(found: f64, expected: f64, within: f64) {
    assert!((found - expected).abs() <= within, "{found}, expected {expected} ± {within}");
}

#[test]
fn begins_at_its_start_level() {
    let out = Tank::default().execute(&TankSettings::default(), 0, REST);
    assert_eq!((out.level_m, out.volume, out.level), (3.0, 3.0, 16_384));
    assert!(!out.full && !out.empty);
}

#[test]
fn pump_alone_fills_by_inflow_over_area() {
    let settings = TankSettings { area: 2.0, ..TankSettings::default() };
    near(run(&settings, 5, PUMP).level_m, 4.0, 1e-9);
    near(run(&settings, 5, PUMP).volume, 8.0, 1e-9);
}

#[test]
fn drain_follows_torricelli() {
    // Closed form: √h falls linearly, √h(t) = √h₀ − q·t / (2·A·√H).
    let h = |t: f64| (3f64.sqrt() - 0.6 * t / (2.0 * 6f64.sqrt())).powi(2);
    for t in [1, 5, 10] {
        near(run(&TankSettings::default(), t, DRAIN).level_m, h(t as f64), 2e-3);
    }
}

#[test]
fn pump_against_drain_settles_where_both_flows_are_equal() {
    // 0.6·√(h/6) = 0.4
    let both = TankInputs { pump: true, ..DRAIN };
    near(run(&TankSettings::default(), 600, both).level_m, 6.0 * (0.4f64 / 0.6).powi(2), 1e-6);
    let mut tank = Tank::default();
    near(tank.execute(&TankSettings::default(), u64::MAX, both).level_m, 6.0 * (0.4f64 / 0.6).powi(2), 1e-6);
}

#[test]
fn leak_always_leaves() {
    let settings = TankSettings { leak: 0.6, ..TankSettings::default() };
    assert_eq!(run(&settings, 5, REST).level_m, run(&TankSettings::default(), 5, DRAIN).level_m);
}

#[test]
fn neither_above_the_rim_nor_below_empty() {
    let full = run(&TankSettings::default(), 100, PUMP);
    assert_eq!((full.level_m, full.level, full.full, full.empty), (6.0, 32_767, true, false));
    let empty = run(&TankSettings::default(), 100, DRAIN);
    assert_eq!((empty.level_m, empty.level, empty.full, empty.empty), (0.0, 0, false, true));
}

#[test]
fn transmitter_line_break_is_word_0_spike_is_word_32767_and_the_level_is_untouched() {
    for (line_break, spike, word) in [(true, false, 0), (false, true, 32_767), (true, true, 0)] {
        let out = Tank::default().execute(&TankSettings::default(), 0, TankInputs { line_break, spike, ..REST });
        assert_eq!((out.level, out.level_m), (word, 3.0));
    }
}

#[test]
fn restored_level_goes_on_and_a_damaged_one_starts_anew() {
    for (level, expected) in [(1.5, 1.5), (99.0, 6.0), (-1.0, 0.0), (f64::NAN, 3.0)] {
        let mut tank = Tank { level: Some(level) };
        assert_eq!(tank.execute(&TankSettings::default(), 0, REST).level_m, expected, "restored {level}");
    }
}
