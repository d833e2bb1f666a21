//! How a case runs, rule by rule, and how a failure is told.

mod support;

use support::{run, told};

/// Cases of which none may fail.
fn all_pass(text: &str) {
    for case in run(text) {
        let failures: String = case.failures.iter().map(|f| f.render(0)).collect();
        assert!(case.passed, "{}: {failures}", case.name);
    }
}

#[test]
fn the_block_is_executed_every_period_from_0_on_and_at_each_step() {
    let cases = run(r#"
        component = "stress"
        [[case]]
        name = "on the beat"
        every = "10ms"
        step = [{ at = "100ms", expect = { outputs = { executions = 11 } } }]
        [[case]]
        name = "off the beat: the next execution is one period after the step"
        every = "10ms"
        step = [
            { at = "25ms", expect = { outputs = { executions = 4 } } },
            { at = "40ms", expect = { outputs = { executions = 6 } } },
        ]
        [[case]]
        name = "only at steps"
        every = "0ms"
        step = [{ at = "1s", expect = { outputs = { executions = 1 } } }, { at = "1s", expect = { outputs = { executions = 2 } } }]
        [[case]]
        name = "without a time a step is the next execution"
        every = "1s"
        step = [{}, {}, { expect = { outputs = { executions = 3 } } }]
    "#);
    for case in &cases {
        assert!(case.passed, "{case:#?}");
    }
    assert_eq!(cases.iter().map(|c| c.executions).collect::<Vec<_>>(), [11, 6, 2, 3]);
    assert_eq!(
        cases.iter().map(|c| c.time_ns).collect::<Vec<_>>(),
        [100_000_000, 40_000_000, 1_000_000_000, 2_000_000_000]
    );
}

#[test]
fn inputs_keep_their_values_commands_last_one_execution() {
    all_pass(
        r#"
        component = "alarm-unit"
        settings = { veracity = false }
        inputs = { level = 30000 }
        [[case]]
        name = "c"
        step = [
            { expect = { outputs = { high = true, violation = true } } },
            { at = "300ms", commands = ["acknowledge"], expect = { outputs = { violation = false, high = true } } },
            { at = "310ms", inputs = { level = 16384 } },
            { at = "320ms", inputs = { level = 30000 }, expect = { outputs = { violation = true } } },
            { at = "700ms", expect = { outputs = { violation = true } } },
        ]
    "#,
    );
}

#[test]
fn a_plain_value_makes_a_signal_good_and_a_quality_alone_keeps_the_value() {
    all_pass(
        r#"
        component = "everything"
        inputs = { echo = "inputs" }
        [[case]]
        name = "c"
        step = [
            { expect = { outputs = { real = { value = 0, quality = "good" } } } },
            { inputs = { real = { value = 1.5, quality = "bad" } }, expect = { outputs = { real = { value = 1.5, quality = "bad" } } } },
            { inputs = { real = { quality = "uncertain" } }, expect = { outputs = { real = { value = 1.5, quality = "uncertain" } } } },
            { inputs = { real = 2 }, expect = { outputs = { real = { value = 2, quality = "good" } } } },
        ]
        [[case.table]]
        columns = ["inputs.real.quality", "inputs.real", "outputs.real", "outputs.real.quality"]
        rows = [["bad", 3, 3, "bad"], ["", 4, 4, "good"], ["uncertain", "", 4, "uncertain"]]
    "#,
    );
}

#[test]
fn every_type_of_port_goes_in_and_is_expected() {
    all_pass(
        r#"
        component = "everything"
        inputs = { echo = "inputs" }
        [[case]]
        name = "c"
        [[case.step]]
        inputs = { yes = true, a = 255, b = 65535, c = 4294967295, d = 9223372036854775807, e = -128, f = -32768, g = -2147483648, h = -9223372036854775808, i = 0.1, j = 1e-300, mode = "automatic", options = "fast|verbose", time = "1h 1ns", drive = { speed = -5, torque = 2.5, limits = { low = -1, high = inf, mode = "manual" } } }
        expect.outputs = { yes = true, a = 255, b = 65535, c = 4294967295, d = 9223372036854775807, e = -128, f = -32768, g = -2147483648, h = -9223372036854775808, i = 0.1, j = 1e-300, mode = "automatic", options = "fast|verbose", time = "1h 1ns", drive.speed = -5, drive.limits.low = -1, drive.limits.high = inf, drive.limits.mode = "manual", drive.torque = { value = 2.5, quality = "good" } }
        [[case.step]]
        inputs = { j = nan, i = -0.0 }
        expect.outputs = { j = nan, i = 0 }
    "#,
    );
}

#[test]
fn a_tolerance_is_for_reals_and_within_for_any_number() {
    let told = told(
        r#"
        component = "everything"
        inputs = { echo = "inputs" }
        tolerance = 0.1
        [[case]]
        name = "reals within the tolerance, others exact"
        step = [{ inputs = { j = 1.05, i = 0.95, a = 10, g = -10, time = "95ms" }, expect = { outputs = { j = 1, i = 1, a = { value = 11, within = 1 }, g = { value = -9, within = 1 }, time = { value = "0.1s", within = "5ms" } } } }]
        [[case]]
        name = "what is out is told with it"
        step = [{ inputs = { j = 1.2, i = 0.5, a = 10, g = -10, time = "95ms" }, expect = { outputs = { j = 1, i = { value = 1, within = 0.25 }, a = 11, g = { value = -8, within = 1 }, time = { value = "0.1s", within = "4ms" } } } }]
    "#,
    );
    insta::assert_snapshot!("tolerance", told);
}

#[test]
fn settings_are_those_of_the_file_the_case_and_the_step_over_the_defaults() {
    all_pass(
        r#"
        component = "everything"
        settings = { a = 1, b = 2 }
        inputs = { echo = "settings" }
        [[case]]
        name = "c"
        settings = { b = 3 }
        step = [
            { expect = { outputs = { a = 1, b = 3 } } },
            { settings = { a = 9 }, expect = { outputs = { a = 9, b = 3 } } },
        ]
    "#,
    );
}

#[test]
fn a_refusal_is_expected_by_a_part_of_its_sentence_and_leaves_what_was() {
    all_pass(
        r#"
        component = "bounds-check"
        inputs = { signal = 51 }
        [[case]]
        name = "of a step"
        step = [{ settings = { low-limit = 90 }, expect = { refused = "must be below", outputs = { high = true } } }]
        [[case]]
        name = "of the start"
        settings = { low-limit = 90 }
        expect = { refused = "low-limit 90" }
    "#,
    );
    let told = told(
        r#"
        component = "bounds-check"
        [[case]]
        name = "not refused"
        step = [{ settings = { low-limit = 1 }, expect = { refused = "must be below" } }]
        [[case]]
        name = "refused for another reason"
        step = [{ settings = { low-limit = 90 }, expect = { refused = "finite" } }]
        [[case]]
        name = "refused out of the blue"
        step = [{ settings = { low-limit = 90 } }]
        [[case]]
        name = "the start refused out of the blue"
        settings = { low-limit = 90 }
        step = [{}]
        [[case]]
        name = "the start not refused"
        expect = { refused = "x" }
    "#,
    );
    insta::assert_snapshot!("refusals", told);
}

#[test]
fn a_fault_is_expected_by_its_kind_and_a_restart_after_it_is_cold() {
    all_pass(
        r#"
        component = "stress"
        [[case]]
        name = "by command"
        step = [
            { expect = { outputs = { executions = 1 } } },
            { commands = ["trap"], expect = { fault = "trap" } },
            { at = "1s", restart = true, expect = { outputs = { executions = 1 } } },
            { commands = ["divide-by-zero"], expect = { fault = "trap" } },
            { restart = true, commands = ["grow-memory"], expect = { fault = "memory" } },
            { restart = true, commands = ["recurse"], expect = { fault = "stack" } },
            { restart = true, commands = ["bad-enum"], expect = { fault = "result" } },
        ]
        [[case]]
        name = "in configure"
        step = [{ settings = { trap = true }, expect = { fault = "trap" } }]
        [[case]]
        name = "at the start"
        settings = { trap = true }
        expect = { fault = "trap" }
    "#,
    );
    let told = told(
        r#"
        component = "stress"
        [[case]]
        name = "out of the blue, between two steps"
        inputs = { fault = "trap", from = 3 }
        step = [{}, { at = "1s" }, { at = "2s" }]
        [[case]]
        name = "out of the blue, at a step"
        step = [{ commands = ["trap"] }, { expect = { outputs = { executions = 2 } } }]
        [[case]]
        name = "another one"
        step = [{ commands = ["recurse"], expect = { fault = "trap" } }]
        [[case]]
        name = "none"
        step = [{ expect = { fault = "trap" } }]
    "#,
    );
    insta::assert_snapshot!("faults", told);
}

#[test]
fn a_block_that_never_ends_is_stopped_by_its_budget() {
    all_pass(
        r#"
        component = "stress"
        budget = "100ms"
        [[case]]
        name = "c"
        step = [{ commands = ["endless-loop"], expect = { fault = "budget" } }]
    "#,
    );
}

#[test]
fn a_restart_keeps_what_is_retained_and_nothing_else() {
    all_pass(
        r#"
        component = "stress"
        [[case]]
        name = "c"
        step = [
            { at = "50ms", expect = { outputs = { executions = 6 }, state = { executions = 6 } } },
            { at = "60ms", restart = true, expect = { outputs = { executions = 7 } } },
        ]
    "#,
    );
}

#[test]
fn a_state_is_where_a_case_goes_on_from_and_what_it_does_not_name_is_as_the_block_starts() {
    all_pass(
        r#"
        component = "ctu"
        inputs = { pv = 5 }
        [[case]]
        name = "c"
        state = { cv = 4 }
        step = [{ inputs = { cu = true }, expect = { outputs = { cv = 5, q = true }, state = { cv = 5, cu = true } } }]
    "#,
    );
}

#[test]
fn first_and_elapsed_are_those_of_a_start_unless_the_case_says_otherwise() {
    all_pass(
        r#"
        component = "ton"
        inputs = { in = true, pt = "1s" }
        [[case]]
        name = "a cold start has no elapsed time"
        state = { in = true }
        step = [{ expect = { outputs = { et = "0ns" } } }, { expect = { outputs = { et = "10ms" } } }]
        [[case]]
        name = "unless it is given"
        state = { in = true }
        elapsed = "7ms"
        step = [{ expect = { outputs = { et = "7ms" } } }, { expect = { outputs = { et = "17ms" } } }]
    "#,
    );
}

#[test]
fn a_swap_carries_state_settings_and_inputs_over_by_name() {
    all_pass(
        r#"
        component = "ton"
        inputs = { pt = "50ms" }
        [[case]]
        name = "to itself: the time goes on without a break"
        step = [
            { at = "0ms", inputs = { in = true } },
            { at = "30ms", swap = "ton", expect = { outputs = { et = "30ms", q = false } } },
            { at = "50ms", expect = { outputs = { et = "50ms", q = true } } },
        ]
    "#,
    );
}

#[test]
fn a_swap_that_cannot_be_leaves_the_version_before_with_its_ports() {
    all_pass(
        r#"
        component = "stress"
        [[case]]
        name = "the new version traps in configure"
        step = [
            { expect = { outputs = { executions = 1 } } },
            { swap = "stress", settings = { trap = true }, expect = { refused = "trap", outputs = { executions = 2 } } },
            { swap = "stress", settings = { refuse = true }, expect = { refused = "", outputs = { executions = 3 } } },
            { swap = "stress", expect = { outputs = { executions = 4 } } },
        ]
    "#,
    );
    let told = told(
        r#"
        component = "stress"
        [[case]]
        name = "refused out of the blue"
        step = [{}, { swap = "stress", settings = { refuse = true } }, { expect = { outputs = { executions = 99 } } }]
        [[case]]
        name = "not refused"
        step = [{}, { swap = "stress", expect = { refused = "x" } }, { expect = { outputs = { executions = 99 } } }]
    "#,
    );
    insta::assert_snapshot!("swaps", told);
}

#[test]
fn alarms_are_all_that_are_on_or_single_ones_in_a_column() {
    let told = told(
        r#"
        component = "alarm-unit"
        settings = { veracity = false }
        inputs = { level = 30000 }
        [[case]]
        name = "all of them"
        step = [{ expect = { alarms = [] } }, { expect = { alarms = ["high", "door"] } }, { expect = { alarms = ["high"] } }]
        [[case]]
        name = "single ones"
        [[case.table]]
        columns = ["alarms.high", "alarms.door"]
        rows = [[true, ""], ["", false], [true, true]]
    "#,
    );
    insta::assert_snapshot!("alarms", told);
}

#[test]
fn a_failure_shows_what_was_before_and_after_and_only_the_first_are_told_in_full() {
    let told = told(
        r#"
        component = "ton"
        inputs = { pt = "30ms" }
        [[case]]
        name = "one"
        step = [
            { at = "20ms", inputs = { in = true } },
            { at = "40ms", expect = { outputs = { q = true } } },
            { at = "100ms", inputs = { in = false } },
        ]
        [[case]]
        name = "many"
        step = [{}, {}, {}, {}, {}, {}]
        [[case.table]]
        columns = ["outputs.q"]
        rows = [[true], [true], [true], [true], [true], [true]]
    "#,
    );
    insta::assert_snapshot!("failures", told);
}
