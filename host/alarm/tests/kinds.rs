//! The specification's nine kinds, row by row: what each kind takes to become normal again.

use latchwork_alarm::{Alarm, Code, CodeKind, Input, Refusal, Rules, State, Transition};

const S: u64 = 1_000_000_000;

fn rules(kind: CodeKind) -> Rules {
    Rules { kind, on_delay: 0, off_delay: 0 }
}

/// Goes through a life: what was told, as `word state`.
fn life(rules: Rules, inputs: &[(u64, Input)]) -> Vec<String> {
    let mut alarm = Alarm::default();
    let mut told = Vec::new();
    for (time, input) in inputs {
        let result = alarm.step(&rules, *input, time * S, |t| {
            told.push(format!("{} {} {}", t.time as f64 / 1e9, t.word, t.to.name()));
        });
        if let Err(refusal) = result {
            told.push(format!("{time} {refusal}"));
        }
    }
    told
}

use Input::*;

#[test]
fn codes_are_the_nine_of_the_table_and_no_others() {
    let table = [
        (51200, CodeKind::AlarmReset),
        (49152, CodeKind::Alarm),
        (52224, CodeKind::AlarmAcknowledgeReset),
        (50176, CodeKind::AlarmAcknowledge),
        (40960, CodeKind::Warning),
        (45056, CodeKind::Message),
        (36864, CodeKind::CommandToggle),
        (36992, CodeKind::CommandOneShot),
        (41088, CodeKind::CommandRetained),
    ];
    for (bits, kind) in table {
        assert_eq!(Code::new(bits, "x").map(Code::kind), Ok(kind));
    }
    let good = (0..=u16::MAX).filter(|bits| Code::new(*bits, "x").is_ok()).count();
    assert_eq!(good, 9);
    let error = Code::new(0xC80, "Zone_B.Miss").unwrap_err().to_string();
    assert!(error.starts_with("`Zone_B.Miss` has the code 0x0C80 (3200), which is none of the nine"), "{error}");
}

#[test]
fn row_c800_must_be_reset() {
    let told = life(
        rules(CodeKind::AlarmReset),
        &[(1, Condition(true)), (2, Acknowledge), (3, Reset), (4, Condition(false)), (5, Reset), (6, Reset)],
    );
    let expected = [
        "1 raised active",
        "2 there is nothing to acknowledge",
        "3 the condition is still there; reset it when it has gone",
        "4 returned awaiting-reset",
        "5 reset normal",
        "6 there is nothing to reset",
    ];
    assert_eq!(told, expected);
}

#[test]
fn row_c000_resets_itself() {
    for kind in [CodeKind::Alarm, CodeKind::Warning, CodeKind::Message] {
        let told = life(rules(kind), &[(1, Condition(true)), (2, Condition(false))]);
        assert_eq!(told, ["1 raised active", "2 returned normal"], "{kind:?}");
    }
}

#[test]
fn row_cc00_must_be_acknowledged_and_reset() {
    let told = life(
        rules(CodeKind::AlarmAcknowledgeReset),
        &[(1, Condition(true)), (2, Condition(false)), (3, Reset), (4, Acknowledge), (5, Reset)],
    );
    let expected = [
        "1 raised unacknowledged",
        "2 returned returned",
        "3 acknowledge it first",
        "4 acknowledged awaiting-reset",
        "5 reset normal",
    ];
    assert_eq!(told, expected);
}

#[test]
fn row_c400_stays_listed_until_acknowledged() {
    let kind = rules(CodeKind::AlarmAcknowledge);
    let gone_first = life(kind, &[(1, Condition(true)), (2, Condition(false)), (3, Acknowledge)]);
    assert_eq!(gone_first, ["1 raised unacknowledged", "2 returned returned", "3 acknowledged normal"]);
    let seen_first = life(kind, &[(1, Condition(true)), (2, Acknowledge), (3, Condition(false))]);
    assert_eq!(seen_first, ["1 raised unacknowledged", "2 acknowledged active", "3 returned normal"]);
    // An acknowledgement is for the occurrence there was.
    let again = life(kind, &[(1, Condition(true)), (2, Acknowledge), (3, Condition(false)), (4, Condition(true))]);
    assert_eq!(again.last().map(String::as_str), Some("4 raised unacknowledged"));
}

#[test]
fn delays_a_condition_counts_when_it_has_lasted() {
    let rules = Rules { kind: CodeKind::Alarm, on_delay: 5 * S, off_delay: 3 * S };
    let told = life(
        rules,
        &[(1, Condition(true)), (4, Condition(false)), (10, Condition(true)), (20, Condition(false)), (30, Tick)],
    );
    assert_eq!(told, ["15 raised active", "23 returned normal"]);
}

#[test]
fn a_mask_during_the_delay_lets_nothing_come_through() {
    let rules = Rules { kind: CodeKind::Alarm, on_delay: 5 * S, off_delay: 0 };
    for (mask, unmask) in
        [(Shelve(100 * S), Unshelve), (Suppress(true), Suppress(false)), (OutOfService(true), OutOfService(false))]
    {
        let told = life(rules, &[(1, Condition(true)), (4, mask), (50, Tick), (60, unmask), (64, Tick), (65, Tick)]);
        let raised: Vec<_> = told.iter().filter(|t| t.contains("raised")).collect();
        assert_eq!(raised, ["65 raised active"], "{mask:?}: the delay begins anew");
    }
}

#[test]
fn a_shelf_ends_by_itself() {
    let told = life(rules(CodeKind::AlarmAcknowledge), &[(1, Condition(true)), (2, Shelve(10 * S)), (20, Tick)]);
    let expected = ["1 raised unacknowledged", "2 shelved shelved", "10 shelf-over unacknowledged"];
    assert_eq!(told, expected, "what stood before stands again");
}

#[test]
fn what_ends_behind_a_mask_still_waits_for_its_acknowledgement() {
    let told = life(
        rules(CodeKind::AlarmAcknowledgeReset),
        &[(1, Condition(true)), (2, Suppress(true)), (3, Condition(false)), (4, Suppress(false)), (5, Acknowledge)],
    );
    let expected = [
        "1 raised unacknowledged",
        "2 suppressed suppressed",
        "4 unsuppressed returned",
        "5 acknowledged awaiting-reset",
    ];
    assert_eq!(told[..2], expected[..2]);
    assert_eq!(told[told.len() - 2..], expected[2..]);
}

#[test]
fn the_code_shows_what_the_alarm_is() {
    let rules = rules(CodeKind::AlarmAcknowledge);
    let mut alarm = Alarm::default();
    let mut code = |input| {
        alarm.step(&rules, input, S, |_: Transition| {}).unwrap();
        alarm.code(&rules)
    };
    assert_eq!(code(Tick), 0xC400);
    assert_eq!(code(Condition(true)), 0xC400 | 1 << 4 | 1 << 1 | 1);
    assert_eq!(code(Acknowledge), 0xC400 | 1 << 5 | 1 << 4 | 1);
    assert_eq!(code(Condition(false)), 0xC400);
}

#[test]
fn operators_hear_why_not() {
    let rules = rules(CodeKind::AlarmAcknowledge);
    let mut alarm = Alarm::default();
    let mut ask = |input| alarm.step(&rules, input, 10 * S, |_: Transition| {});
    assert_eq!(ask(Shelve(9 * S)), Err(Refusal::ShelfOver));
    assert_eq!(ask(Unshelve), Err(Refusal::NotShelved));
    assert_eq!(ask(Shelve(20 * S)), Ok(()));
    assert_eq!(ask(Shelve(20 * S)), Err(Refusal::Already));
    assert_eq!(ask(Acknowledge), Err(Refusal::Hidden));
    assert_eq!(ask(OutOfService(false)), Err(Refusal::Already));
    assert_eq!(alarm.state(), State::Shelved);
}
