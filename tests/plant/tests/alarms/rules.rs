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

#[test]
fn a_tag_is_named_with_or_without_the_backslashes_of_a_regular_expression() {
    for pattern in ["field.off", "field\\\\.off", "field\\.off"] {
        let quote = if pattern.contains("\\\\") { '"' } else { '\'' };
        let ran = plant(&format!("[[alarm]]\nmatch = {quote}{pattern}{quote}\ncode = 0xC000\n"))
            .stimulus("20ms,field.off,true\n")
            .run_for(50 * MS);
        assert_eq!(told(&ran), ["20 field.off raised normal>active"], "{pattern}");
    }
}

#[test]
fn no_condition_is_lost_when_more_change_at_once_than_a_queue_holds() {
    // Twice as many alarms as there are places in the lane's queue.
    let mut text = String::from(
        "[lane.main]\nevery = \"10ms\"\n[driver.field]\nkind = \"sim\"\n[driver.field.points]\nall = { type = \"bool\" }\n",
    );
    for n in 0..2048 {
        text += &format!(
            "[block.a{n}]\ncomponent = \"digital-alarm\"\nlane = \"main\"\ninputs.input = \"field.all\"\nbudget = \"100ms\"\n"
        );
    }
    let ran = latchwork_tests_plant::Rig::new(&text)
        .trace(None)
        .stimulus("50ms,field.all,true\n400ms,field.all,false\n")
        .run_for(900 * MS);
    let count = |word: &str| {
        let of_word = ran.records.iter().filter(|r| r.transition == word && r.source.ends_with(".alarms.alarm"));
        of_word.map(|r| r.source.as_str()).collect::<std::collections::BTreeSet<_>>().len()
    };
    assert_eq!((count("raised"), count("returned")), (2048, 2048));
}
