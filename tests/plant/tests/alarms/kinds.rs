//! The specification's table of codes, row by row, through a plant: raised, acknowledged, returned, reset.

use super::{MS, plant, told};

#[test]
fn each_kind_takes_what_its_row_says_to_become_normal() {
    // (code, its row, what is told when the condition comes at 10, an operator acknowledges at 30, it goes at 50, is reset at 70).
    let table: [(&str, &str, &[&str]); 4] = [
        (
            "0xC800",
            "logged alarm, must be reset",
            &[
                "10 a raised normal>active",
                "50 a returned active>awaiting-reset",
                "70 a reset awaiting-reset>normal by stimulus",
            ],
        ),
        ("0xC000", "logged alarm, resets itself", &["10 a raised normal>active", "50 a returned active>normal"]),
        (
            "0xCC00",
            "logged alarm, must be acknowledged and reset",
            &[
                "10 a raised normal>unacknowledged",
                "30 a acknowledged unacknowledged>active by stimulus",
                "50 a returned active>awaiting-reset",
                "70 a reset awaiting-reset>normal by stimulus",
            ],
        ),
        (
            "0xC400",
            "logged alarm, resets itself, must be acknowledged",
            &[
                "10 a raised normal>unacknowledged",
                "30 a acknowledged unacknowledged>active by stimulus",
                "50 a returned active>normal",
            ],
        ),
    ];
    for (code, row, expected) in table {
        let ran = plant(&format!("[[alarm]]\nmatch = 'a\\.alarms\\.alarm'\ncode = {code}\n"))
            .stimulus("10ms,field.a,true\n30ms,a.alarms.alarm,ack\n50ms,field.a,false\n70ms,a.alarms.alarm,reset\n")
            .run_for(100 * MS);
        assert_eq!(told(&ran), expected, "{code}: {row}");
    }
}

#[test]
fn an_acknowledged_alarm_that_is_gone_stays_listed_until_then() {
    let ran = plant("[[alarm]]\nmatch = '.*\\.alarms\\.alarm'\ncode = 0xC400\n")
        .stimulus("10ms,field.a,true\n20ms,field.a,false\n50ms,a.alarms.alarm,ack\n")
        .run_for(100 * MS);
    let expected = [
        "10 a raised normal>unacknowledged",
        "20 a returned unacknowledged>returned",
        "50 a acknowledged returned>normal by stimulus",
    ];
    assert_eq!(told(&ran), expected);
}

#[test]
fn warnings_and_messages_are_told_and_an_alarm_without_a_rule_resets_itself() {
    let ran = plant(
        "[[alarm]]\nmatch = 'a\\..*'\ncode = 0xA000\ntext = \"look at $0\"\n[[alarm]]\nmatch = 'b\\..*'\ncode = 0xB000\n",
    )
    .stimulus("10ms,field.a,true\n10ms,field.b,true\n10ms,field.c,true\n30ms,field.c,false\n")
    .run_for(50 * MS);
    assert_eq!(told(&ran), ["10 a raised normal>active", "10 c raised normal>active", "30 c returned active>normal"]);
    let a = ran.records.iter().find(|r| r.source == "a.alarms.alarm").expect("the warning");
    assert_eq!((a.priority, a.text.as_str()), (96, "look at a.alarms.alarm"));
    let b = ran.records.iter().find(|r| r.source == "b.alarms.alarm").expect("the message");
    assert_eq!((b.kind.name(), &*b.transition, b.priority), ("message", "raised", 32));
}
