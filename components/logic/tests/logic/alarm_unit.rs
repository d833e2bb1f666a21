//! Alarm unit, row "alarm unit": word → scale → veracity → bounds → pulse → flag → lamp, by its sentences. Default
//! settings (limits 10 and 50, step 5, pulse 200 ms, blink 500/500 ms, door 100 ms), scans of 10 ms.

use crate::MS;
use latchwork_logic::{
    AlarmUnit, AlarmUnitCommands, AlarmUnitInputs, AlarmUnitOutputs, AlarmUnitSettings, AnalogSettings, Quality, Scale,
};

const NONE: AlarmUnitCommands = AlarmUnitCommands { acknowledge: false, silence: false, reset: false };
const ACKNOWLEDGE: AlarmUnitCommands = AlarmUnitCommands { acknowledge: true, ..NONE };
const SILENCE: AlarmUnitCommands = AlarmUnitCommands { silence: true, ..NONE };
const RESET: AlarmUnitCommands = AlarmUnitCommands { reset: true, ..NONE };

/// An alarm unit with its settings and inputs, at virtual time.
struct Bench {
    unit: AlarmUnit,
    settings: AlarmUnitSettings,
    inputs: AlarmUnitInputs,
}

/// The word that stands for a value of 0 to 60.
fn word(value: f64) -> u16 {
    (value / 60.0 * 32_767.0).round() as u16
}

impl Bench {
    /// Runs one scan at 30, well within the limits.
    fn new() -> Self {
        Self::with(AlarmUnitSettings::default())
    }

    fn with(settings: AlarmUnitSettings) -> Self {
        assert_eq!(settings.check(), Ok(()));
        let inputs = AlarmUnitInputs { level: word(30.0), ..AlarmUnitInputs::default() };
        let mut bench = Self { unit: AlarmUnit::default(), settings, inputs };
        assert!(quiet(&bench.scan(NONE)));
        bench
    }

    fn scan(&mut self, commands: AlarmUnitCommands) -> AlarmUnitOutputs {
        self.unit.execute(&self.settings, 10 * MS, self.inputs, commands)
    }

    /// Scans without commands; returns the last outputs.
    fn run(&mut self, ms: u64) -> AlarmUnitOutputs {
        (0..ms / 10).map(|_| self.scan(NONE)).last().expect("at least one scan")
    }

    /// Moves the value in steps the veracity check believes.
    fn ramp(&mut self, to: f64) -> AlarmUnitOutputs {
        let mut value = (f64::from(self.inputs.level) / 32_767.0 * 60.0).round();
        loop {
            value += (to - value).clamp(-4.0, 4.0);
            self.inputs.level = word(value);
            let out = self.scan(NONE);
            if value == to {
                return out;
            }
        }
    }

    /// Past every running pulse, acknowledged.
    fn acknowledged(&mut self) -> AlarmUnitOutputs {
        self.run(300);
        self.scan(ACKNOWLEDGE)
    }
}

fn quiet(out: &AlarmUnitOutputs) -> bool {
    !(out.lamp || out.horn || out.violation || out.high || out.low || out.door || out.hardware_fault)
}

#[test]
fn the_word_is_scaled_to_0_to_60() {
    for (level, value) in [(1, 60.0 / 32_767.0), (16_384, 30.000_915_555), (32_767, 60.0)] {
        let inputs = AlarmUnitInputs { level, ..AlarmUnitInputs::default() };
        let out = AlarmUnit::default().execute(&AlarmUnitSettings::default(), 0, inputs, NONE);
        assert!((out.value.value - value).abs() < 1e-6 && out.value.quality == Quality::Good);
    }
}

#[test]
fn leaving_the_range_sets_the_flag_and_starts_sound_and_light() {
    for (to, high, low) in [(52.0, true, false), (8.0, false, true)] {
        let out = Bench::new().ramp(to);
        assert_eq!((out.high, out.low, out.violation, out.lamp, out.horn), (high, low, true, true, true), "at {to}");
    }
}

#[test]
fn the_flag_outlives_the_violation_until_acknowledged() {
    let mut bench = Bench::new();
    bench.ramp(52.0);
    let out = bench.ramp(30.0);
    assert_eq!((out.high, out.violation), (false, true));
    bench.run(300);
    assert!(quiet(&bench.scan(ACKNOWLEDGE)));
}

#[test]
fn acknowledged_it_stays_acknowledged_while_the_value_stays_too_high() {
    let mut bench = Bench::new();
    bench.ramp(52.0);
    let out = bench.acknowledged();
    assert_eq!((out.violation, out.lamp, out.horn, out.high), (false, false, false, true));
    assert!(!bench.run(5_000).violation);
    bench.ramp(30.0);
    assert!(bench.ramp(52.0).violation, "the next excursion is a new violation");
}

#[test]
fn a_violation_younger_than_the_pulse_cannot_be_acknowledged_away() {
    let mut bench = Bench::new();
    assert!(!bench.ramp(49.0).violation);
    assert!(bench.ramp(52.0).violation);
    for ms in (10..200).step_by(10) {
        assert!(bench.scan(ACKNOWLEDGE).violation, "{ms} ms after");
    }
    assert!(!bench.scan(ACKNOWLEDGE).violation, "200 ms after");
}

#[test]
fn a_violation_that_comes_back_during_its_pulse_has_a_pulse_of_its_own() {
    for back_at in [100, 190, 200] {
        let mut bench = Bench::with(AlarmUnitSettings { veracity: false, ..AlarmUnitSettings::default() });
        bench.inputs.level = word(52.0);
        bench.scan(NONE);
        bench.inputs.level = word(30.0);
        bench.run(back_at - 10);
        bench.inputs.level = word(52.0);
        assert!(bench.scan(ACKNOWLEDGE).violation, "back {back_at} ms after the first");
        assert!((0..19).all(|_| bench.scan(ACKNOWLEDGE).violation));
        assert!(!bench.scan(ACKNOWLEDGE).violation);
    }
}

#[test]
fn the_lamp_blinks_while_the_flag_is_set() {
    let mut bench = Bench::new();
    assert!(bench.ramp(52.0).lamp);
    let lamp: Vec<bool> = (0..40).map(|_| bench.run(250).lamp).collect();
    let expected: Vec<bool> = (1..=40).map(|n| n * 250 % 1_000 < 500).collect();
    assert_eq!(lamp, expected);
}

#[test]
fn silence_mutes_the_horn_until_the_next_violation_and_the_lamp_goes_on() {
    let mut bench = Bench::new();
    bench.ramp(52.0);
    let out = bench.scan(SILENCE);
    assert_eq!((out.horn, out.violation, out.lamp), (false, true, true));
    assert!(!bench.run(1_000).horn);
    bench.inputs.door = true;
    assert!(!bench.run(100).horn, "door not believed yet");
    let out = bench.run(10);
    assert_eq!((out.door, out.horn), (true, true));
}

#[test]
fn a_violation_in_the_scan_of_silence_sounds() {
    let mut bench = Bench::new();
    bench.ramp(49.0);
    bench.inputs.level = word(51.0);
    let out = bench.scan(SILENCE);
    assert_eq!((out.violation, out.horn), (true, true));
}

#[test]
fn the_binary_channel_is_checked_and_its_change_sets_the_flag() {
    let mut bench = Bench::new();
    bench.inputs.door = true;
    assert!(quiet(&bench.run(90)), "a bounce of 90 ms");
    bench.inputs.door = false;
    assert!(quiet(&bench.run(500)));
    bench.inputs.door = true;
    assert!(quiet(&bench.run(100)));
    let out = bench.run(10);
    assert_eq!((out.door, out.violation, out.lamp, out.horn), (true, true, true, true));
    assert!(!bench.acknowledged().violation);
    assert!(!bench.run(5_000).violation, "one change is one violation");
}

#[test]
fn spike_dip_and_line_break_raise_the_hardware_fault_and_no_process_alarm() {
    for level in [32_767, word(2.0), 0] {
        let mut bench = Bench::new();
        bench.inputs.level = level;
        for _ in 0..100 {
            let out = bench.scan(NONE);
            assert_eq!((out.hardware_fault, out.high, out.low, out.violation), (true, false, false, false), "{level}");
            assert_eq!(out.value.quality, Quality::Uncertain);
            assert!((out.value.value - 30.0).abs() < 1e-2, "30 is held");
        }
        bench.inputs.level = word(31.0);
        let out = bench.scan(NONE);
        assert!(quiet(&out) && out.value.quality == Quality::Good, "near again, it passes");
    }
}

#[test]
fn a_hardware_fault_during_a_violation_raises_nothing_when_it_comes_and_goes() {
    let mut bench = Bench::new();
    bench.ramp(52.0);
    assert!(!bench.acknowledged().violation);
    for level in [0, word(52.0), 32_767, word(52.0)] {
        bench.inputs.level = level;
        let out = bench.run(500);
        assert_eq!((out.high, out.violation, out.horn), (true, false, false), "word {level}");
    }
}

#[test]
fn a_word_above_32767_is_a_hardware_fault_also_without_the_veracity_check() {
    for veracity in [true, false] {
        let mut bench = Bench::with(AlarmUnitSettings { veracity, ..AlarmUnitSettings::default() });
        bench.ramp(49.0);
        bench.inputs.level = 32_768;
        let out = bench.scan(NONE);
        assert_eq!((out.hardware_fault, out.high, out.violation), (true, false, false));
        assert_eq!(out.value.quality, Quality::Uncertain);
        assert!((out.value.value - 49.0).abs() < 1e-2, "the last value is held");
    }
}

#[test]
fn with_nothing_to_hold_the_value_is_bad() {
    let mut unit = AlarmUnit::default();
    let inputs = AlarmUnitInputs { level: 40_000, ..AlarmUnitInputs::default() };
    let out = unit.execute(&AlarmUnitSettings::default(), 0, inputs, NONE);
    assert_eq!((out.hardware_fault, out.value.quality, out.value.value), (true, Quality::Bad, 0.0));
    assert!(!(out.high || out.low || out.violation));
}

#[test]
fn without_the_veracity_check_a_jump_from_one_side_to_the_other_is_a_new_violation() {
    let mut bench = Bench::with(AlarmUnitSettings { veracity: false, ..AlarmUnitSettings::default() });
    bench.inputs.level = word(55.0);
    assert!(bench.scan(NONE).high);
    assert!(!bench.acknowledged().violation);
    bench.inputs.level = word(5.0);
    let out = bench.scan(NONE);
    assert_eq!((out.high, out.low, out.violation, out.horn), (false, true, true, true));
}

#[test]
fn the_offset_trims_the_checked_value_and_is_no_step_of_the_check() {
    let mut bench = Bench::new();
    bench.inputs.offset = 15.0;
    let out = bench.scan(NONE);
    assert!((out.value.value - 45.0).abs() < 1e-2 && quiet(&out));
    bench.inputs.offset = 25.0;
    assert!(bench.scan(NONE).high);
}

#[test]
fn an_offset_that_is_no_number_is_a_hardware_fault_and_the_last_one_stays() {
    for offset in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut bench = Bench::new();
        bench.inputs.offset = 10.0;
        bench.scan(NONE);
        bench.inputs.offset = offset;
        let out = bench.run(1_000);
        assert_eq!((out.hardware_fault, out.high, out.low, out.violation), (true, false, false, false));
        assert!((out.value.value - 40.0).abs() < 1e-2 && out.value.quality == Quality::Uncertain);
    }
}

#[test]
fn test_lights_lamp_and_horn_and_touches_nothing_else() {
    let mut bench = Bench::new();
    bench.inputs.test = true;
    let out = bench.run(2_000);
    assert!(quiet(&AlarmUnitOutputs { lamp: false, horn: false, ..out }) && out.lamp && out.horn);
    bench.inputs.test = false;
    assert!(quiet(&bench.scan(NONE)));
}

#[test]
fn test_is_steady_and_leaves_phase_and_silence_of_a_violation_alone() {
    let (mut tested, mut plain) = (Bench::new(), Bench::new());
    for bench in [&mut tested, &mut plain] {
        bench.ramp(52.0);
        bench.scan(SILENCE);
    }
    tested.inputs.test = true;
    plain.run(730);
    assert!((0..73).all(|_| {
        let out = tested.scan(NONE);
        out.lamp && out.horn
    }));
    tested.inputs.test = false;
    assert_eq!(tested.unit, plain.unit);
}

#[test]
fn zeros_before_the_first_word_are_no_reference_later_zeros_are_a_line_break() {
    let mut unit = AlarmUnit::default();
    let mut run = |level| {
        let inputs = AlarmUnitInputs { level, ..AlarmUnitInputs::default() };
        unit.execute(&AlarmUnitSettings::default(), 10 * MS, inputs, NONE)
    };
    assert!(!run(0).hardware_fault);
    assert!(!run(0).hardware_fault);
    let first = run(word(30.0));
    assert!(!first.hardware_fault && (first.value.value - 30.0).abs() < 1e-2);
    assert!(run(0).hardware_fault);
}

#[test]
fn reset_accepts_the_present_word_after_a_repair() {
    let mut bench = Bench::new();
    bench.inputs.level = word(45.0);
    assert!(bench.run(1_000).hardware_fault);
    let out = bench.scan(RESET);
    assert!(quiet(&out) && (out.value.value - 45.0).abs() < 1e-2);
}

#[test]
fn check_period_and_average_reach_the_veracity_check() {
    let analog = AnalogSettings { period: 100 * MS, average: 2, ..AnalogSettings::default() };
    let mut bench = Bench::with(AlarmUnitSettings { analog, ..AlarmUnitSettings::default() });
    bench.inputs.level = word(34.0);
    assert!((bench.run(90).value.value - 30.0).abs() < 1e-2, "next check after 100 ms");
    assert!((bench.run(10).value.value - 32.0).abs() < 1e-2, "average of 30 and 34");
}

#[test]
fn an_inverted_transmitter_works() {
    let scale = Scale { low: 60.0, high: 0.0, ..Scale::default() };
    let mut bench = Bench::with(AlarmUnitSettings { scale, ..AlarmUnitSettings::default() });
    assert!(bench.ramp(55.0).low);
}

#[test]
fn restore_keeps_what_the_operator_sees_and_raises_nothing_anew() {
    let mut bench = Bench::new();
    bench.inputs.door = true;
    bench.ramp(52.0);
    bench.run(300);
    bench.scan(SILENCE);
    for acknowledged in [false, true] {
        if acknowledged {
            bench.scan(ACKNOWLEDGE);
        }
        let before = bench.scan(NONE);
        let state = bench.unit.save();
        bench.unit = AlarmUnit::default();
        bench.unit.restore(state);
        assert_eq!(bench.unit.save(), state);
        let after = bench.scan(NONE);
        assert!(after.high && after.door && !after.horn);
        assert_eq!(after.violation, !acknowledged);
        assert_eq!(after.lamp, after.violation, "the lamp begins with on");
        assert_eq!(after.value, before.value);
    }
}

#[test]
fn restore_keeps_the_reference_of_the_veracity_check() {
    let mut bench = Bench::new();
    let state = bench.unit.save();
    bench.unit = AlarmUnit::default();
    bench.unit.restore(state);
    bench.inputs.level = word(55.0);
    let out = bench.scan(NONE);
    assert_eq!((out.hardware_fault, out.high), (true, false));
}
