//! What outlives a run: states of alarms, shelves, retained commands, settings.

use super::{MS, plant, told};

const RULES: &str = "[[alarm]]\nmatch = '.*\\.alarms\\.alarm'\ncode = 0xCC00\nsuppress-when = \"field.off\"\n";

#[test]
fn an_acknowledgement_outlives_a_restart_and_the_plant_says_what_has_gone_meanwhile() {
    let before = plant(RULES)
        .stimulus("10ms,field.a,true\n10ms,field.b,true\n10ms,field.c,true\n30ms,a.alarms.alarm,ack\n30ms,c.alarms.alarm,ack\n")
        .run_for(50 * MS);
    assert_eq!(told(&before).len(), 5);
    // a goes on, b has returned while nobody looked, c too.
    let after =
        plant(RULES).after(&before.kept).stimulus("0ms,field.a,true\n40ms,c.alarms.alarm,reset\n").run_for(100 * MS);
    let expected = [
        "0 b returned unacknowledged>returned",
        "0 c returned active>awaiting-reset",
        "40 c reset awaiting-reset>normal by stimulus",
    ];
    assert_eq!(told(&after), expected);
}

#[test]
fn a_new_occurrence_after_a_restart_is_not_hidden_by_the_old_acknowledgement() {
    let before = plant(RULES).stimulus("10ms,field.a,true\n30ms,a.alarms.alarm,ack\n").run_for(50 * MS);
    let after = plant(RULES).after(&before.kept).stimulus("20ms,field.a,true\n").run_for(50 * MS);
    assert_eq!(told(&after), ["0 a returned active>awaiting-reset", "20 a raised awaiting-reset>unacknowledged"]);
}

#[test]
fn shelves_and_service_outlive_a_restart() {
    let before = plant(RULES)
        .stimulus("10ms,field.a,true\n20ms,a.alarms.alarm,shelve 300ms\n20ms,b.alarms.alarm,out-of-service\n")
        .run_for(50 * MS);
    // Virtual time begins at 0 again: the shelf ends at 320 ms of it.
    let after = plant(RULES).after(&before.kept).stimulus("0ms,field.a,true\n10ms,field.b,true\n").run_for(500 * MS);
    assert_eq!(told(&after), ["320 a shelf-over shelved>unacknowledged"]);
}

#[test]
fn suppression_is_what_the_plant_says_after_the_restart() {
    let before = plant(RULES).stimulus("10ms,field.off,true\n").run_for(50 * MS);
    assert_eq!(told(&before).len(), 3);
    let still = plant(RULES).after(&before.kept).stimulus("0ms,field.off,true\n20ms,field.a,true\n").run_for(50 * MS);
    assert_eq!(told(&still), [""; 0]);
    let gone = plant(RULES).after(&before.kept).stimulus("20ms,field.a,true\n").run_for(50 * MS);
    assert_eq!(told(&gone)[..3].iter().filter(|t| t.starts_with("0 ")).count(), 3, "{:?}", told(&gone));
    assert_eq!(told(&gone)[3], "20 a raised normal>unacknowledged");
}

#[test]
fn a_rule_that_no_longer_asks_for_something_does_not_wait_for_it() {
    let before = plant(RULES).stimulus("10ms,field.a,true\n20ms,field.a,false\n").run_for(50 * MS);
    let after = plant("").after(&before.kept).stimulus("20ms,field.a,true\n").run_for(50 * MS);
    assert_eq!(told(&after), ["20 a raised normal>active"]);
}

#[test]
fn what_cannot_be_read_is_told_and_begins_anew() {
    let kept = [("alarm/a.alarms.alarm".to_owned(), "{".to_owned())].into();
    let after = plant(RULES).after(&kept).run_for(20 * MS);
    let lament = after.records.iter().find(|r| r.transition == "not-restored").expect("a record");
    assert!(lament.text.contains("a.alarms.alarm"), "{}", lament.text);
}

#[test]
fn the_first_of_a_group_is_the_first_after_a_restart_too() {
    const GROUP: &str = "[[alarm]]\nmatch = '.*\\.alarms\\.alarm'\ncode = 0xC000\ngroup = \"g\"\ntext = \"t\"\n";
    let before = plant(GROUP).stimulus("10ms,field.a,true\n20ms,field.a,false\n").run_for(50 * MS);
    let after = plant(GROUP).after(&before.kept).stimulus("10ms,field.b,true\n20ms,field.a,true\n").run_for(50 * MS);
    let raised: Vec<_> = after.records.iter().filter(|r| r.transition == "raised").map(|r| r.text.as_str()).collect();
    assert_eq!(raised, ["t (the first of group g)", "t"]);
}

#[test]
fn a_retained_command_outlives_a_restart_and_no_change_of_its_rule() {
    let kept = [("command/a.commands.block".to_owned(), "true".to_owned())].into();
    let rule = |code: &str| plant(&format!("[[alarm]]\nmatch = 'a\\.commands\\.block'\ncode = {code}\n")).after(&kept);
    let still = rule("0xA080").run_for(50 * MS);
    assert_eq!(still.at("a.commands.block", 40 * MS), "true");
    assert!(still.records.iter().any(|r| r.source == "a.commands.block" && r.transition == "restored"));
    let gone = rule("0x9080").run_for(50 * MS);
    assert_eq!(gone.at("a.commands.block", 40 * MS), "false");
    assert!(gone.records.iter().any(|r| r.source == "a.commands.block" && r.transition == "forgotten"));
}

#[test]
fn what_can_no_longer_be_told_suppresses_nothing_after_a_restart() {
    let before = plant(RULES).stimulus("10ms,field.off,true\n").run_for(50 * MS);
    let rules = "[[alarm]]\nmatch = '.*\\.alarms\\.alarm'\ncode = 0xC000\n";
    let after = plant(rules).after(&before.kept).stimulus("20ms,field.a,true\n").run_for(50 * MS);
    assert_eq!(told(&after), ["20 a raised normal>active"]);
}
