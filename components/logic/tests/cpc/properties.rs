//! What holds on any input: NaN, infinities, 0 and the longest times, settings that `check` would refuse, any restored
//! state. A panic (overflow checks are on) fails each of these as well.

use latchwork_logic::{Quality, Signal, Ton, cpc::*};
use proptest::prelude::*;

fn time() -> impl Strategy<Value = u64> {
    prop_oneof![Just(0), Just(u64::MAX), Just(1), 0..200_000_000u64, any::<u64>()]
}

fn real() -> impl Strategy<Value = f64> {
    const SPECIAL: &[f64] =
        &[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, f64::MAX, f64::MIN, f64::MIN_POSITIVE];
    prop_oneof![3 => (-20..140i32).prop_map(f64::from), 1 => proptest::sample::select(SPECIAL), 1 => any::<f64>()]
}

fn quality() -> impl Strategy<Value = Quality> {
    prop_oneof![4 => Just(Quality::Good), 1 => Just(Quality::Uncertain), 1 => Just(Quality::Bad)]
}

fn signal() -> impl Strategy<Value = Signal> {
    (real(), quality()).prop_map(|(value, quality)| Signal { value, quality })
}

fn binary() -> impl Strategy<Value = Binary> {
    (any::<bool>(), quality()).prop_map(|(value, quality)| Binary { value, quality })
}

fn rare() -> impl Strategy<Value = bool> {
    proptest::bool::weighted(0.15)
}

fn scans<T: std::fmt::Debug>(one: impl Strategy<Value = T>) -> impl Strategy<Value = Vec<T>> {
    proptest::collection::vec(one, 1..60)
}

fn forces() -> impl Strategy<Value = ForceCommands> {
    (rare(), rare(), rare()).prop_map(|(force_true, force_false, unforce)| ForceCommands {
        force_true,
        force_false,
        unforce,
    })
}

fn analog_forces() -> impl Strategy<Value = AnalogForceCommands> {
    (rare(), rare()).prop_map(|(force, unforce)| AnalogForceCommands { force, unforce })
}

fn alarm_commands() -> impl Strategy<Value = AlarmCommands> {
    (rare(), rare(), rare()).prop_map(|(acknowledge, block, unblock)| AlarmCommands { acknowledge, block, unblock })
}

fn rule() -> impl Strategy<Value = RestartRule> {
    proptest::sample::select(&[RestartRule::Acknowledge, RestartRule::Command, RestartRule::CommandEarly][..])
}

fn modes() -> impl Strategy<Value = ModeInputs> {
    (any::<bool>(), rare(), rare(), rare(), rare()).prop_map(
        |(auto_on, auto_off, auto_mode_request, inhibit_manual, inhibit_forced)| ModeInputs {
            auto_on,
            auto_off,
            auto_mode_request,
            inhibit_manual,
            inhibit_forced,
        },
    )
}

fn interlocks() -> impl Strategy<Value = InterlockInputs> {
    (rare(), rare(), rare()).prop_map(|(start, temporary, full)| InterlockInputs { start, temporary, full })
}

fn orders() -> impl Strategy<Value = OrderCommands> {
    proptest::array::uniform5(rare()).prop_map(|[auto_mode, manual_mode, forced_mode, on_order, off_order]| {
        OrderCommands { auto_mode, manual_mode, forced_mode, on_order, off_order }
    })
}

fn interlock_commands() -> impl Strategy<Value = InterlockCommands> {
    (any::<bool>(), any::<bool>())
        .prop_map(|(acknowledge, allow_restart)| InterlockCommands { acknowledge, allow_restart })
}

fn on_off_settings() -> impl Strategy<Value = OnOffSettings> {
    (any::<[bool; 4]>(), 0..300u64, rule()).prop_map(
        |(
            [fail_safe_on, has_feedback_on, has_feedback_off, full_stop_at_start],
            feedback_timeout,
            full_stop_restart,
        )| {
            OnOffSettings {
                fail_safe_on,
                has_feedback_on,
                has_feedback_off,
                feedback_timeout,
                full_stop_restart,
                full_stop_at_start,
            }
        },
    )
}

fn on_off_inputs() -> impl Strategy<Value = OnOffInputs> {
    (modes(), (rare(), any::<bool>(), rare()), any::<[bool; 4]>(), interlocks()).prop_map(
        |(auto, (local, local_on, local_off), [feedback_on, feedback_off, io_error, simulated], interlocks)| {
            OnOffInputs {
                first: false,
                auto,
                local,
                local_on,
                local_off,
                feedback_on,
                feedback_off,
                interlocks,
                io_error,
                simulated,
            }
        },
    )
}

fn rising(now: bool, before: &mut bool) -> bool {
    now && !std::mem::replace(before, now)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn digital_io_forced_follows_the_operator_alone(
        inverted in any::<bool>(),
        rows in scans((binary(), any::<[bool; 3]>(), forces(), 0..100u64)),
    ) {
        let (mut input, mut output, mut held) = (DigitalInput::default(), DigitalOutput::default(), None);
        let out_settings = DigitalOutputSettings { inverted, has_readback: true, mismatch_time: 50 };
        for (raw, [readback, io_error, simulated], commands, elapsed) in rows {
            if commands.force_true { held = Some(true) }
            if commands.force_false { held = Some(false) }
            if commands.unforce { held = None }
            let out = input.execute(&DigitalInputSettings { inverted }, raw, simulated, commands);
            prop_assert_eq!(out.position.value, held.unwrap_or(raw.value != inverted));
            prop_assert_eq!(out.status.io_error, raw.quality == Quality::Bad, "forced hides no error");
            prop_assert_eq!((out.status.forced, out.status.simulated), (held.is_some(), simulated));
            let inputs = DigitalOutputInputs { order: raw.value, readback, io_error, simulated };
            let out = output.execute(&out_settings, elapsed, inputs, commands);
            prop_assert_eq!(out.output != inverted, held.unwrap_or(raw.value));
            prop_assert!(!out.status.mismatch || readback != out.output);
        }
    }

    #[test]
    fn analog_input_is_finite_and_never_good_during_an_error(
        numbers in proptest::array::uniform6(real()), forced_value in -1e3..1e3f64, filter_time in time(),
        rows in scans((time(), signal(), analog_forces())),
    ) {
        let [raw_low, raw_high, low, high, margin, deadband] = numbers;
        let settings =
            AnalogInputSettings { raw_low, raw_high, low, high, margin, deadband, filter_time, forced_value };
        let mut input = AnalogInput::default();
        for (elapsed, raw, commands) in rows {
            let out = input.execute(&settings, elapsed, raw, false, commands);
            prop_assert!(out.value.value.is_finite() && out.measured.is_finite());
            prop_assert!(!out.status.io_error || out.status.forced || out.value.quality == Quality::Bad);
            prop_assert!(raw.is_usable() || out.status.io_error);
            prop_assert!(!out.status.forced || out.value.value == forced_value);
        }
    }

    #[test]
    fn analog_input_filtered_stays_within_what_was_measured(
        filter_time in time(), rows in scans((time(), 0.0..1_000.0f64)),
    ) {
        let settings = AnalogInputSettings { raw_high: 1_000.0, filter_time, ..AnalogInputSettings::default() };
        let (mut input, mut low, mut high) = (AnalogInput::default(), f64::MAX, f64::MIN);
        for (elapsed, raw) in rows {
            (low, high) = (low.min(raw / 10.0), high.max(raw / 10.0));
            let raw = Signal::new(raw, Quality::Good);
            let out = input.execute(&settings, elapsed, raw, false, AnalogForceCommands::default());
            prop_assert!((low - 1e-9..=high + 1e-9).contains(&out.measured), "{} in {low} to {high}", out.measured);
        }
    }

    #[test]
    fn analog_output_never_leaves_its_range_nor_exceeds_its_rate(
        (low, high, raw_low, raw_high) in (real(), real(), real(), real()),
        (rate_limit, start, forced_value) in (real(), real(), real()),
        rows in scans((0..10_000_000_000u64, signal(), analog_forces())),
    ) {
        let settings = AnalogOutputSettings { low, high, raw_low, raw_high, rate_limit, start, forced_value };
        let mut output = AnalogOutput::default();
        let (least, most, mut last) = (low.min(high), low.max(high), None::<f64>);
        for (elapsed, order, commands) in rows {
            let inputs = AnalogOutputInputs { order, ..AnalogOutputInputs::default() };
            let out = output.execute(&settings, elapsed, inputs, commands);
            if settings.check().is_err() { continue }
            prop_assert!((least..=most).contains(&out.position) && (raw_low..=raw_high).contains(&out.raw));
            if let Some(last) = last.filter(|_| rate_limit > 0.0) {
                let most = rate_limit * (elapsed as f64 / 1e9);
                prop_assert!((out.position - last).abs() <= most * 1.000_001 + last.abs() * 1e-12);
            }
            last = Some(out.position);
        }
    }

    /// Against the rule in words: enabled and true without a break for the delay.
    #[test]
    fn digital_alarm_stands_exactly_after_its_delay(
        delay in 0..100u64, alarm_on_io_error in any::<bool>(),
        rows in scans((0..60u64, binary(), rare(), rare(), alarm_commands())),
    ) {
        let settings = DigitalAlarmSettings { delay, alarm_on_io_error };
        let (mut alarm, mut stood, mut blocked, mut shown, mut unacknowledged) =
            (DigitalAlarm::default(), None, false, false, false);
        for (elapsed, input, disable, auto_acknowledge, commands) in rows {
            let condition = input.value || (alarm_on_io_error && input.quality == Quality::Bad);
            stood = (condition && !disable).then(|| stood.map_or(0, |s: u64| s + elapsed));
            if commands.block { blocked = true }
            if commands.unblock { blocked = false }
            let active = stood.is_some_and(|s| s >= delay);
            let came = rising(active && !blocked, &mut shown);
            if commands.acknowledge { unacknowledged = false }
            if came { unacknowledged = true }
            if auto_acknowledge { unacknowledged = false }
            shown = active && !blocked;
            let inputs = DigitalAlarmInputs { input, disable, auto_acknowledge, simulated: false };
            let out = alarm.execute(&settings, elapsed, inputs, commands);
            prop_assert_eq!((out.status.active, out.interlock), (active, active && !blocked));
            prop_assert_eq!(out.status.unacknowledged, unacknowledged);
            prop_assert_eq!(out.status.pending, stood.is_some() && !active);
        }
    }

    #[test]
    fn alarms_survive_any_restored_state(
        (input, q, et) in (any::<bool>(), any::<bool>(), time()), delay in time(),
        rows in scans((time(), signal(), binary(), alarm_commands())),
    ) {
        let delay_state = Ton { input, q, et };
        let threshold = Threshold { beyond: q, delay: delay_state };
        let mut digital = DigitalAlarm { delay: delay_state, ..DigitalAlarm::default() };
        let mut analog =
            AnalogAlarm { thresholds: Thresholds::all(threshold), io_error: delay_state, ..AnalogAlarm::default() };
        for (elapsed, value, input, commands) in rows {
            let settings = DigitalAlarmSettings { delay, ..DigitalAlarmSettings::default() };
            let inputs = DigitalAlarmInputs { input, ..DigitalAlarmInputs::default() };
            digital.execute(&settings, elapsed, inputs, commands);
            let settings = AnalogAlarmSettings { delay, ..AnalogAlarmSettings::default() };
            let inputs = AnalogAlarmInputs { value, ..AnalogAlarmInputs::default() };
            analog.execute(&settings, elapsed, inputs, commands);
        }
    }

    #[test]
    fn analog_alarm_thresholds_agree_with_each_other(
        hysteresis in (0..60i32).prop_map(f64::from), delay in 0..100u64,
        rows in scans((0..60u64, signal(), alarm_commands())),
    ) {
        let settings = AnalogAlarmSettings { hysteresis, delay, ..AnalogAlarmSettings::default() };
        prop_assert_eq!(settings.check(), Ok(()));
        let (mut alarm, mut before) = (AnalogAlarm::default(), AnalogAlarmOutputs::default());
        for (elapsed, value, commands) in rows {
            let inputs = AnalogAlarmInputs { value, ..AnalogAlarmInputs::default() };
            let out = alarm.execute(&settings, elapsed, inputs, commands);
            let active = out.status.active;
            prop_assert!((!active.hh || active.h) && (!active.ll || active.l), "{active:?}");
            prop_assert!(!(active.h && active.l), "{active:?}");
            prop_assert!(!out.status.blocked || !(out.interlock || out.warning));
            prop_assert!(out.status.blocked || !(active.hh || active.ll) || out.interlock);
            prop_assert!(!out.interlock || before.interlock || out.status.unacknowledged, "ack hides nothing");
            before = out;
        }
    }

    #[test]
    fn on_off_is_in_its_fail_safe_position_under_every_stop_in_every_mode(
        settings in on_off_settings(),
        rows in scans((time(), on_off_inputs(), orders(), interlock_commands())),
    ) {
        let (mut actuator, mut before) = (OnOff::default(), OnOffOutputs::default());
        let (mut last, mut position_alarm) = (InterlockInputs::default(), false);
        for (index, (elapsed, inputs, orders, commands)) in rows.into_iter().enumerate() {
            let inputs = OnOffInputs { first: index == 0, ..inputs };
            let (was_started, was_latched) = (actuator.started, actuator.interlocks.latched);
            let out = actuator.execute(&settings, elapsed, inputs, orders, commands);
            let (status, now) = (out.status, inputs.interlocks);
            if now.full || now.temporary || status.full_stop {
                prop_assert_eq!(out.output, settings.fail_safe_on);
                prop_assert!(out.interlocked);
            }
            if now.start && !was_started {
                prop_assert_eq!(out.output, settings.fail_safe_on, "no start");
            }
            let stopped_at_start = index == 0 && settings.full_stop_at_start;
            prop_assert!(!stopped_at_start || status.full_stop);
            let came = stopped_at_start | rising(now.full, &mut last.full) | rising(now.temporary, &mut last.temporary)
                | rising(now.start, &mut last.start) | rising(status.position_alarm, &mut position_alarm);
            (last, position_alarm) = (now, status.position_alarm);
            prop_assert!(!came || status.unacknowledged, "an acknowledgement hides nothing new");
            prop_assert!(!was_latched || actuator.interlocks.latched || commands.acknowledge, "only the operator acknowledges");
            prop_assert!(!before.status.unacknowledged || status.unacknowledged || commands.acknowledge);
            prop_assert!(
                !before.status.restart_needed || status.restart_needed || commands.allow_restart,
                "only the operator allows the restart"
            );
            let modes = [status.auto_mode, status.manual_mode, status.forced_mode, status.local_mode];
            prop_assert_eq!(modes.into_iter().filter(|m| *m).count(), 1, "one mode");
            prop_assert!(!(status.moving && status.position_alarm));
            before = out;
        }
    }

    /// Whatever comes first, and whatever the rule asks for besides.
    #[test]
    fn on_off_with_a_full_stop_at_start_leaves_its_fail_safe_position_only_after_an_acknowledgement(
        settings in on_off_settings(),
        rows in scans((time(), on_off_inputs(), orders(), interlock_commands())),
    ) {
        let settings = OnOffSettings { full_stop_at_start: true, ..settings };
        let (mut actuator, mut acknowledged) = (OnOff::default(), false);
        for (index, (elapsed, inputs, orders, commands)) in rows.into_iter().enumerate() {
            acknowledged |= index > 0 && commands.acknowledge;
            let inputs = OnOffInputs { first: index == 0, ..inputs };
            let out = actuator.execute(&settings, elapsed, inputs, orders, commands);
            prop_assert!(acknowledged || out.output == settings.fail_safe_on);
        }
    }

    /// After a full stop that no auto order or panel holds on, nothing starts by itself.
    #[test]
    fn on_off_nothing_starts_by_itself_after_a_full_stop(
        rule in rule(), rows in scans((interlocks(), orders(), interlock_commands())),
    ) {
        let settings = OnOffSettings { full_stop_restart: rule, ..OnOffSettings::default() };
        let (mut actuator, mut stopped) = (OnOff::default(), false);
        let manual = OrderCommands { manual_mode: true, on_order: true, ..OrderCommands::default() };
        actuator.execute(&settings, 0, OnOffInputs::default(), manual, InterlockCommands::default());
        for (interlocks, orders, commands) in rows {
            let inputs = OnOffInputs { interlocks, ..OnOffInputs::default() };
            let out = actuator.execute(&settings, 1, inputs, orders, commands);
            stopped = (stopped || out.status.full_stop) && !orders.on_order;
            prop_assert!(!stopped || !out.output);
        }
    }

    #[test]
    fn on_off_and_pco_survive_any_restored_state(
        flags in any::<[bool; 12]>(), elapsed in time(), option_mode in any::<u8>(), start_mode in any::<u8>(),
        settings in on_off_settings(),
        rows in scans((time(), on_off_inputs(), orders(), interlock_commands(), any::<u8>())),
    ) {
        let [a, b, c, d, e, f, g, h, i, j, k, l] = flags;
        let orders = Orders { mode: Mode::Forced, auto_mode_request: a, auto: b, manual: c };
        let last = InterlockInputs { start: d, temporary: e, full: f };
        let interlocks = Interlocks { last, latched: g, restart_needed: h, unacknowledged: i };
        let feedback = Supervision { order: j, differs: k, elapsed };
        let mut actuator = OnOff { orders, interlocks, started: l, feedback, position_alarm: a };
        let mut unit = Pco { orders, interlocks, run: j, option_mode, refused: k, auto_dependents: l };
        let OnOffSettings { full_stop_restart, full_stop_at_start, .. } = settings;
        let unit_settings = PcoSettings { start_mode, full_stop_restart, full_stop_at_start, ..PcoSettings::default() };
        for (elapsed, inputs, orders, commands, option) in rows {
            let out = actuator.execute(&settings, elapsed, inputs, orders, commands);
            prop_assert!(!out.status.full_stop || out.output == settings.fail_safe_on);
            let inputs = PcoInputs { auto: inputs.auto, auto_option_mode: option, interlocks: inputs.interlocks, ..PcoInputs::default() };
            let commands = PcoCommands { orders, interlocks: commands, option_modes: option, dependents_auto: false };
            let out = unit.execute(&unit_settings, inputs, commands);
            prop_assert!((1..=8).contains(&out.option_mode) && out.mode.count_ones() == 1);
            prop_assert!(!out.status.full_stop || !out.run);
        }
    }

    #[test]
    fn pco_keeps_to_its_table_and_stops(
        allowed in any::<[u8; 8]>(), start_mode in 1..=8u8, full_stop_restart in rule(), full_stop_at_start in any::<bool>(),
        rows in scans((modes(), interlocks(), orders(), interlock_commands(), 0..=12u8, any::<u8>(), rare())),
    ) {
        let settings = PcoSettings { allowed, start_mode, full_stop_restart, full_stop_at_start };
        let (mut unit, mut mode, mut first) = (Pco::default(), start_mode, true);
        for (auto, interlocks, orders, acknowledge, auto_option_mode, option_modes, auto_dependents) in rows {
            let inputs = PcoInputs { first, auto, auto_option_mode, auto_dependents, interlocks, ..PcoInputs::default() };
            first = false;
            let commands = PcoCommands { orders, interlocks: acknowledge, option_modes, dependents_auto: false };
            let out = unit.execute(&settings, inputs, commands);
            let table = allowed[usize::from(mode) - 1] & out.mode != 0;
            prop_assert!(out.option_mode == mode || table, "{mode} to {}", out.option_mode);
            mode = out.option_mode;
            let stop = interlocks.full || interlocks.temporary || out.status.full_stop;
            prop_assert!(!(stop && out.run));
        }
    }
}
