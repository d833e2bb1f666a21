//! Rules: first match, delays, groups, suppression, other tags.

use super::{MS, plant, told};

#[test]
fn the_first_rule_that_matches_counts() {
    let ran = plant(
        "[[alarm]]\nmatch = 'a\\.alarms\\.alarm'\ncode = 0xC800\npriority = \"urgent\"\n\
         [[alarm]]\nmatch = '.*\\.alarms\\..*'\ncode = 52224\npriority = 7\n",
    )
    .stimulus("10ms,field.a,true\n20ms,field.b,true\n")
    .run_for(50 * MS);
    assert_eq!(told(&ran), ["10 a raised normal>active", "20 b raised normal>unacknowledged"]);
    let priorities: Vec<_> =
        ran.records.iter().filter(|r| r.transition == "raised").map(|r| (r.source.as_str(), r.priority)).collect();
    assert_eq!(priorities, [("a.alarms.alarm", 240), ("b.alarms.alarm", 7)]);
}

#[test]
fn delays_end_at_their_own_time_between_scans() {
    let ran =
        plant("[[alarm]]\nmatch = '.*\\.alarms\\.alarm'\ncode = 0xC000\non-delay = \"25ms\"\noff-delay = \"15ms\"\n")
            .stimulus(
                "10ms,field.a,true\n30ms,field.a,false\n100ms,field.a,true\n140ms,field.a,false\n150ms,field.a,true\n\
             200ms,field.a,false\n",
            )
            .run_for(300 * MS);
    // 20 ms are too short; a break of 10 ms is no return.
    assert_eq!(told(&ran), ["125 a raised normal>active", "215 a returned active>normal"]);
}

#[test]
fn the_first_of_a_group_is_told_from_those_that_follow() {
    let ran = plant("[[alarm]]\nmatch = '([ab])\\.alarms\\.alarm'\ncode = 0xC000\ngroup = \"pumps\"\ntext = \"pump $1\"\n")
        .stimulus("10ms,field.b,true\n20ms,field.a,true\n30ms,field.c,true\n40ms,field.a,false\n50ms,field.b,false\n70ms,field.a,true\n")
        .run_for(100 * MS);
    let raised: Vec<_> = ran.records.iter().filter(|r| r.transition == "raised").map(|r| r.text.as_str()).collect();
    assert_eq!(raised, ["pump b (the first of group pumps)", "pump a", "", "pump a (the first of group pumps)"]);
}

#[test]
fn a_suppressed_alarm_does_not_come_through_not_even_during_its_delay() {
    let rules =
        "[[alarm]]\nmatch = 'a\\.alarms\\.alarm'\ncode = 0xC400\non-delay = \"50ms\"\nsuppress-when = \"field.off\"\n";
    let ran =
        plant(rules).stimulus("10ms,field.a,true\n40ms,field.off,true\n200ms,field.off,false\n").run_for(300 * MS);
    let expected = [
        "40 a suppressed normal>suppressed",
        "200 a unsuppressed suppressed>normal",
        // It stands, so its delay begins anew.
        "250 a raised normal>unacknowledged",
    ];
    assert_eq!(told(&ran), expected);
}

#[test]
fn suppression_goes_before_what_comes_at_the_same_time() {
    let rules =
        "[[alarm]]\nmatch = 'a\\.alarms\\.alarm'\ncode = 0xC000\nsuppress-when = { tag = \"field.off\", not = true }\n";
    let ran = plant(rules)
        .stimulus("0ms,field.off,true\n50ms,field.a,true\n50ms,field.off,false\n90ms,field.off,true\n")
        .run_for(150 * MS);
    let expected =
        ["50 a suppressed normal>suppressed", "90 a unsuppressed suppressed>normal", "90 a raised normal>active"];
    assert_eq!(told(&ran), expected);
}

#[test]
fn a_rule_makes_an_alarm_of_a_tag_that_it_names() {
    let ran = plant("[[alarm]]\nmatch = \"field.off\"\ncode = 0xC800\ntext = \"the drive is off\"\n[[alarm]]\nmatch = 'b\\.outputs\\.interlock'\ncode = 0xC000\n")
        .stimulus("20ms,field.off,true\n30ms,field.b,true\n40ms,field.off,false\n60ms,field.off,reset\n")
        .run_for(100 * MS);
    let expected = [
        "20 field.off raised normal>active",
        "30 b raised normal>active",
        "30 b.outputs.interlock raised normal>active",
        "40 field.off returned active>awaiting-reset",
        "60 field.off reset awaiting-reset>normal by stimulus",
    ];
    assert_eq!(told(&ran), expected);
}
