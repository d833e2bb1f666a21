//! What holds on any input: NaN, infinities, 0 and the longest times, settings `check` would refuse. A panic (overflow
//! checks are on) fails each of these as well.

use latchwork_logic::*;
use proptest::prelude::*;

fn time() -> impl Strategy<Value = u64> {
    prop_oneof![Just(0), Just(u64::MAX), Just(1), 0..200_000_000u64, any::<u64>()]
}

fn real() -> impl Strategy<Value = f64> {
    const SPECIAL: &[f64] =
        &[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, f64::MAX, f64::MIN, f64::MIN_POSITIVE];
    prop_oneof![proptest::sample::select(SPECIAL), -100.0..100.0f64, any::<f64>()]
}

fn signal() -> impl Strategy<Value = Signal> {
    let quality = proptest::sample::select(&[Quality::Good, Quality::Uncertain, Quality::Bad][..]);
    (prop_oneof![3 => 0.0..60.0f64, 1 => real()], quality).prop_map(|(value, quality)| Signal { value, quality })
}

fn analog() -> impl Strategy<Value = AnalogSettings> {
    let step = prop_oneof![0.1..100.0f64, real()];
    (step, time(), any::<u8>()).prop_map(|(max_step, period, average)| AnalogSettings { max_step, period, average })
}

fn bounds() -> impl Strategy<Value = BoundsSettings> {
    (real(), real(), real()).prop_map(|(low_limit, high_limit, hysteresis)| BoundsSettings {
        low_limit,
        high_limit,
        hysteresis,
    })
}

fn blink() -> impl Strategy<Value = MultivibratorSettings> {
    (time(), time()).prop_map(|(on_time, off_time)| MultivibratorSettings { on_time, off_time })
}

fn scale() -> impl Strategy<Value = Scale> {
    (any::<u16>(), any::<u16>(), real(), real()).prop_map(|(raw_low, raw_high, low, high)| Scale {
        raw_low,
        raw_high,
        low,
        high,
    })
}

/// Settings as they come after `check`, and now and then not.
fn alarm_unit() -> impl Strategy<Value = AlarmUnitSettings> {
    let whatever = (time(), scale(), bounds(), any::<bool>(), analog(), time(), blink()).prop_map(
        |(pulse, scale, bounds, veracity, analog, veracity_time, blink)| AlarmUnitSettings {
            pulse,
            scale,
            bounds,
            veracity,
            analog,
            veracity_time,
            blink,
        },
    );
    let usual = any::<bool>().prop_map(|veracity| AlarmUnitSettings { veracity, ..AlarmUnitSettings::default() });
    prop_oneof![3 => usual, 1 => whatever]
}

fn alarm_inputs() -> impl Strategy<Value = AlarmUnitInputs> {
    let level = prop_oneof![4 => 14_000..18_000u16, 2 => any::<u16>(), 1 => Just(0)];
    let offset = prop_oneof![4 => Just(0.0), 1 => -40.0..40.0f64, 1 => real()];
    (level, any::<bool>(), offset, proptest::bool::weighted(0.1))
        .prop_map(|(level, door, offset, test)| AlarmUnitInputs { level, door, offset, test })
}

fn alarm_commands() -> impl Strategy<Value = AlarmUnitCommands> {
    let rare = || proptest::bool::weighted(0.1);
    (rare(), rare(), rare()).prop_map(|(acknowledge, silence, reset)| AlarmUnitCommands { acknowledge, silence, reset })
}

fn scans<T: std::fmt::Debug>(one: impl Strategy<Value = T>) -> impl Strategy<Value = Vec<T>> {
    proptest::collection::vec(one, 1..60)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn timers_et_stays_within_pt(rows in scans((time(), any::<bool>(), time()))) {
        let (mut ton, mut tof, mut tp) = (Ton::default(), Tof::default(), Tp::default());
        for (elapsed, input, pt) in rows {
            let ton_q = ton.execute(elapsed, input, pt);
            let tof_q = tof.execute(elapsed, input, pt);
            let tp_q = tp.execute(elapsed, input, pt);
            prop_assert!(ton.et <= pt && tof.et <= pt && tp.et <= pt);
            prop_assert!(!ton_q || input, "TON is never on without IN");
            prop_assert!(tof_q || !input, "TOF is never off with IN");
            prop_assert!(!tp_q || tp.et < pt, "TP is never on at the end of its time");
            prop_assert!(pt > 0 || (ton_q == input && tof_q == input && !tp_q), "PT 0 is no delay, no pulse");
        }
    }

    /// TOF is TON upside down: the standard's diagrams mirror each other.
    #[test]
    fn timers_tof_mirrors_ton(pt in 1..100u64, rows in scans((0..40u64, any::<bool>()))) {
        let (mut ton, mut tof) = (Ton::default(), Tof::default());
        tof.execute(0, true, pt);
        ton.execute(0, false, pt);
        for (elapsed, input) in rows {
            prop_assert_eq!(tof.execute(elapsed, input, pt), !ton.execute(elapsed, !input, pt));
        }
    }

    #[test]
    fn timers_survive_any_restored_state(
        (input, q, et) in (any::<bool>(), any::<bool>(), time()),
        rows in scans((time(), any::<bool>(), time())),
    ) {
        let (mut ton, mut tof, mut tp) = (Ton { input, q, et }, Tof { input, q, et }, Tp { input, q, et });
        for (elapsed, input, pt) in rows {
            ton.execute(elapsed, input, pt);
            tof.execute(elapsed, input, pt);
            tp.execute(elapsed, input, pt);
            prop_assert!(ton.et <= pt && tof.et <= pt && tp.et <= pt);
        }
    }

    /// The same edges seen through a model with unbounded integers.
    #[test]
    fn counters_count_like_clamped_integers(
        start in any::<i32>(),
        rows in scans((any::<bool>(), any::<bool>(), proptest::bool::weighted(0.1), proptest::bool::weighted(0.1), any::<i32>())),
    ) {
        let mut both = Ctud { cv: start, ..Ctud::default() };
        let (mut up, mut down) = (Ctu { cv: start, ..Ctu::default() }, Ctd { cv: start, ..Ctd::default() });
        let (mut m_up, mut m_down, mut last) = (i64::from(start), i64::from(start), (false, false));
        let mut m_both = m_up;
        let clamped = |v: i64| v.clamp(i32::MIN.into(), i32::MAX.into());
        for (cu, cd, r, ld, pv) in rows {
            let edges = (i64::from(cu && !last.0), i64::from(cd && !last.1));
            last = (cu, cd);
            m_up = if r { 0 } else { clamped(m_up + edges.0) };
            m_down = if ld { pv.into() } else { clamped(m_down - edges.1) };
            m_both = if r { 0 } else if ld { pv.into() } else { clamped(m_both + edges.0 - edges.1) };
            prop_assert_eq!((up.execute(cu, r, pv), i64::from(up.cv)), (m_up >= pv.into(), m_up));
            prop_assert_eq!((down.execute(cd, ld, pv), i64::from(down.cv)), (m_down <= 0, m_down));
            prop_assert_eq!((both.execute(cu, cd, r, ld, pv), i64::from(both.cv)), ((m_both >= pv.into(), m_both <= 0), m_both));
        }
    }

    #[test]
    fn digital_veracity_changes_only_after_the_input_stood_for_the_time(
        time in 0..100u64, rows in scans((0..60u64, any::<bool>())),
    ) {
        let mut check = DigitalVeracity::default();
        let (mut last, mut stood, mut before) = (None, 0, false);
        for (elapsed, din) in rows {
            stood = if last == Some(din) { stood + elapsed } else { 0 };
            last = Some(din);
            let dout = check.execute(elapsed, din, time);
            prop_assert!(dout == before || (stood >= time && dout == din));
            prop_assert!(stood < time || dout == din, "and it does change then");
            before = dout;
        }
    }

    #[test]
    fn digital_veracity_survives_any_state_and_time(
        (dout, din, held) in (any::<bool>(), any::<bool>(), time()), rows in scans((time(), any::<bool>(), time())),
    ) {
        let mut check = DigitalVeracity::default();
        check.restore(DigitalState { dout, din, held });
        for (elapsed, din, time) in rows {
            check.execute(elapsed, din, time);
            prop_assert!(check.save().held <= time);
        }
    }

    #[test]
    fn analog_veracity_on_never_lets_out_what_it_does_not_believe(
        settings in analog(), rows in scans((time(), signal(), proptest::bool::weighted(0.05))),
    ) {
        let mut check = AnalogVeracity::default();
        for (elapsed, input, reset) in rows {
            if reset { check.reset(); }
            let (out, _) = check.execute(&settings, elapsed, true, input);
            prop_assert!(out.value.is_finite());
            prop_assert!(out.quality != Quality::Bad || out.value == 0.0);
        }
    }

    #[test]
    fn analog_veracity_accepts_strictly_smaller_steps_only(max_step in 0.1..50.0f64, rows in scans(signal())) {
        let settings = AnalogSettings { max_step, ..AnalogSettings::default() };
        let (mut check, mut accepted) = (AnalogVeracity::default(), None::<f64>);
        for input in rows {
            let believed = input.is_usable() && accepted.is_none_or(|a| (a - input.value).abs() < max_step);
            if believed { accepted = Some(input.value); }
            let (out, error) = check.execute(&settings, 0, true, input);
            prop_assert_eq!(error, !believed);
            prop_assert_eq!(out.value, accepted.unwrap_or(0.0));
        }
    }

    #[test]
    fn analog_veracity_average_lies_within_what_was_accepted(average in 1..=16u8, values in scans(-1e300..1e300f64)) {
        let settings = AnalogSettings { average, max_step: f64::MAX, period: 0 };
        let mut check = AnalogVeracity::default();
        for i in 0..values.len() {
            let (out, error) = check.execute(&settings, 0, true, Signal { value: values[i], quality: Quality::Good });
            prop_assert!(!error);
            let window = &values[(i + 1).saturating_sub(average.into())..=i];
            let (low, high) = window.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
            prop_assert!((low..=high).contains(&out.value));
        }
    }

    #[test]
    fn multivibrator_is_off_without_run_and_in_phase_with_it(
        (on_time, off_time) in (1..100u64, 1..100u64), rows in scans((0..300u64, proptest::bool::weighted(0.9))),
    ) {
        let settings = MultivibratorSettings { on_time, off_time };
        let (mut blink, mut since) = (Multivibrator::default(), None);
        for (elapsed, run) in rows {
            since = run.then(|| since.map_or(0, |s: u64| s + elapsed));
            let expected = since.is_some_and(|s| s % (on_time + off_time) < on_time);
            prop_assert_eq!(blink.execute(&settings, elapsed, run), expected);
        }
    }

    #[test]
    fn multivibrator_survives_any_settings_and_state(
        (running, on, phase) in (any::<bool>(), any::<bool>(), time()),
        rows in scans((blink(), time(), any::<bool>())),
    ) {
        let mut blink = Multivibrator { running, on, phase };
        for (settings, elapsed, run) in rows {
            prop_assert!(!blink.execute(&settings, elapsed, run) || run);
        }
    }

    #[test]
    fn bounds_are_never_both_high_and_low(settings in bounds(), signals in scans(real())) {
        let mut check = BoundsCheck::default();
        for signal in signals {
            prop_assert_eq!(check.execute(&settings, signal), signal.is_nan());
            prop_assert!(!(check.high.q1 && check.low.q1));
        }
    }

    /// The specification's four sentences, one flip-flop each, wherever the hysteresis is narrower than the limits.
    #[test]
    fn bounds_follow_the_specification(
        low_limit in -50.0..0.0f64, span in 1.0..50.0f64, part in 0.0..1.0f64, signals in scans(-120.0..120.0f64),
    ) {
        let settings = BoundsSettings { low_limit, high_limit: low_limit + span, hysteresis: span * part };
        prop_assert_eq!(settings.check(), Ok(()));
        let (mut check, mut high, mut low) = (BoundsCheck::default(), false, false);
        for s in signals {
            if s > settings.high_limit { high = true }
            if s < settings.high_limit - settings.hysteresis { high = false }
            if s < settings.low_limit { low = true }
            if s > settings.low_limit + settings.hysteresis { low = false }
            check.execute(&settings, s);
            prop_assert_eq!((check.high.q1, check.low.q1), (high, low));
        }
    }

    #[test]
    fn scale_is_finite_and_within_its_ends_on_accepted_settings(scale in scale(), raw in any::<u16>()) {
        let (out, out_of_range) = scale.execute(raw);
        prop_assert_eq!(out_of_range, raw < scale.raw_low || raw > scale.raw_high);
        prop_assert_eq!(out.quality == Quality::Bad, out_of_range);
        if scale.check().is_ok() {
            prop_assert!(out.value.is_finite());
            let (low, high) = (scale.low.min(scale.high), scale.low.max(scale.high));
            let rounding = low.abs().max(high.abs()) * 1e-15;
            prop_assert!(out_of_range || (out.value >= low - rounding && out.value <= high + rounding));
        }
    }

    #[test]
    fn tank_stays_between_empty_and_rim(
        (height, area, start) in (0.1..1e6f64, 1e-3..1e6f64, real()),
        flows in (0.0..1e6f64, 0.0..1e6f64, 0.0..1e6f64),
        rows in scans((time(), any::<[bool; 4]>())),
    ) {
        let settings = TankSettings { height, area, inflow: flows.0, outflow: flows.1, leak: flows.2, start };
        let mut tank = Tank::default();
        for (elapsed, [pump, drain, line_break, spike]) in rows {
            let out = tank.execute(&settings, elapsed, TankInputs { pump, drain, line_break, spike });
            prop_assert!((0.0..=height).contains(&out.level_m) && out.level <= 32_767 && out.volume.is_finite());
            prop_assert_eq!((out.full, out.empty), (out.level_m >= height, out.level_m <= 0.0));
        }
    }

    #[test]
    fn tank_survives_any_settings(numbers in proptest::array::uniform6(real()), level in real(), elapsed in time()) {
        let [height, area, inflow, outflow, leak, start] = numbers;
        let settings = TankSettings { height, area, inflow, outflow, leak, start };
        let mut tank = Tank { level: Some(level) };
        let out = tank.execute(&settings, elapsed, TankInputs { pump: true, drain: true, ..TankInputs::default() });
        if settings.check().is_ok() {
            prop_assert!((0.0..=height).contains(&out.level_m) && out.level <= 32_767);
        }
    }

    #[test]
    fn alarm_unit_a_hardware_fault_never_raises_a_process_alarm(
        settings in alarm_unit(), rows in scans((time(), alarm_inputs(), alarm_commands())),
    ) {
        let mut unit = AlarmUnit::default();
        let mut last = AlarmUnitOutputs::default();
        for (elapsed, inputs, commands) in rows {
            let out = unit.execute(&settings, elapsed, inputs, commands);
            if out.hardware_fault {
                prop_assert!((out.high, out.low) == (last.high, last.low));
                let door_opened = out.door && !last.door;
                prop_assert!(!out.violation || last.violation || door_opened);
                prop_assert!(out.value.quality != Quality::Good);
            }
            prop_assert!(!(out.high && out.low));
            prop_assert!(out.value.value.is_finite());
            prop_assert!(!out.lamp || out.violation || inputs.test);
            prop_assert!(!out.horn || out.violation || inputs.test);
            last = out;
        }
    }

    #[test]
    fn alarm_unit_every_new_violation_sets_flag_and_horn(
        veracity in any::<bool>(),
        rows in scans((0..300_000_000u64, alarm_inputs(), alarm_commands())),
    ) {
        let settings = AlarmUnitSettings { veracity, ..AlarmUnitSettings::default() };
        let mut unit = AlarmUnit::default();
        let mut last = AlarmUnitOutputs::default();
        for (elapsed, inputs, commands) in rows {
            let out = unit.execute(&settings, elapsed, inputs, commands);
            let new = (out.high && !last.high) || (out.low && !last.low) || (out.door && !last.door);
            prop_assert!(!new || (out.violation && out.horn && !unit.save().silenced));
            prop_assert!(new || !out.violation || last.violation, "and nothing else sets it");
            last = out;
        }
    }

    /// Save, restore, go on: as if nothing had happened, for the classes whose retained state says it all.
    #[test]
    fn restored_in_the_middle_equals_uninterrupted(
        rows in scans((0..60_000_000u64, any::<[bool; 4]>(), signal())), at in 0..60usize, (time, pv) in (0..100_000_000u64, -3..3i32),
    ) {
        let blink_settings = MultivibratorSettings { on_time: time + 1, off_time: 70_000_000 };
        let analog_settings = AnalogSettings::default();
        let tank_settings = TankSettings::default();
        let (mut digital, mut analog, mut blink) =
            (DigitalVeracity::default(), AnalogVeracity::default(), Multivibrator::default());
        let (mut digital2, mut analog2) = (digital, analog);
        let (mut tank, mut tank2) = (Tank::default(), Tank::default());
        let (mut ctud, mut bounds) = (Ctud::default(), BoundsCheck::default());
        let (mut ctud2, mut bounds2, mut blink2) = (ctud, bounds, blink);
        for (i, (elapsed, [a, b, c, d], signal)) in rows.into_iter().enumerate() {
            if i == at {
                let state = digital2.save();
                digital2 = DigitalVeracity::default();
                digital2.restore(state);
                prop_assert_eq!(digital2.save(), state);
                let state = analog2.save();
                analog2 = AnalogVeracity::default();
                analog2.restore(state);
                prop_assert_eq!(analog2.save(), state);
                tank2 = Tank { level: tank2.level };
                ctud2 = Ctud { cv: ctud2.cv, cu: RTrig { m: ctud2.cu.m }, cd: RTrig { m: ctud2.cd.m } };
                bounds2 = BoundsCheck { high: Rs { q1: bounds2.high.q1 }, low: Rs { q1: bounds2.low.q1 } };
                blink2 = Multivibrator { running: blink2.running, on: blink2.on, phase: blink2.phase };
            }
            prop_assert_eq!(digital.execute(elapsed, a, time), digital2.execute(elapsed, a, time));
            let on = b || c;
            let (x, y) = (analog.execute(&analog_settings, elapsed, on, signal), analog2.execute(&analog_settings, elapsed, on, signal));
            prop_assert!(x == y || (x.0.value.is_nan() && y.0.value.is_nan() && x.1 == y.1));
            let inputs = TankInputs { pump: a, drain: b, line_break: c, spike: d };
            prop_assert_eq!(tank.execute(&tank_settings, elapsed, inputs), tank2.execute(&tank_settings, elapsed, inputs));
            prop_assert_eq!(ctud.execute(a, b, c && d, d && a, pv), ctud2.execute(a, b, c && d, d && a, pv));
            let limits = BoundsSettings::default();
            prop_assert_eq!((bounds.execute(&limits, signal.value), bounds), (bounds2.execute(&limits, signal.value), bounds2));
            prop_assert_eq!(blink.execute(&blink_settings, elapsed, on), blink2.execute(&blink_settings, elapsed, on));
        }
    }
}
