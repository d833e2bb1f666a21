//! What operators do about alarms, settings and commands, and what is refused.

use super::{MS, plant, told};
use latchwork_record::Kind;

#[test]
fn a_shelved_alarm_comes_back_by_itself() {
    let ran = plant("[[alarm]]\nmatch = '.*\\.alarms\\.alarm'\ncode = 0xC400\n")
        .stimulus("10ms,field.a,true\n20ms,a.alarms.alarm,shelve 55ms\n100ms,a.alarms.alarm,shelve 1h\n120ms,a.alarms.alarm,unshelve\n")
        .run_for(200 * MS);
    let expected = [
        "10 a raised normal>unacknowledged",
        "20 a shelved unacknowledged>shelved by stimulus",
        "75 a shelf-over shelved>unacknowledged",
        "100 a shelved unacknowledged>shelved by stimulus",
        "120 a unshelved shelved>unacknowledged by stimulus",
    ];
    assert_eq!(told(&ran), expected);
}

#[test]
fn what_is_refused_is_on_record_with_its_reason() {
    let ran = plant("[[alarm]]\nmatch = '.*\\.alarms\\.alarm'\ncode = 0xC800\n")
        .stimulus("10ms,field.a,true\n20ms,a.alarms.alarm,reset\n30ms,a.alarms.alarm,ack\n40ms,a.settings.delay,1m\n")
        .run_for(100 * MS);
    let refused: Vec<_> = ran.records.iter().filter(|r| r.transition == "refused").collect();
    assert_eq!(refused.len(), 2, "{refused:?}");
    assert!(refused.iter().all(|r| r.kind == Kind::Command && r.source == "a.alarms.alarm" && r.user == "stimulus"));
    assert!(
        refused[0].text.starts_with("reset: `a.alarms.alarm`: the condition is still there"),
        "{}",
        refused[0].text
    );
    assert!(
        refused[1].text.starts_with("acknowledge: `a.alarms.alarm`: there is nothing to acknowledge"),
        "{}",
        refused[1].text
    );
}

#[test]
fn settings_are_staged_then_written_through_the_block_then_shown() {
    let ran = plant("").stimulus("40ms,a.settings.delay,50ms\n100ms,field.a,true\n").run_for(300 * MS);
    let settings: Vec<_> = ran
        .records
        .iter()
        .filter(|r| r.kind == Kind::Setting)
        .map(|r| format!("{} {} {} {}>{}", r.time / MS, r.source, r.transition, r.previous, r.current))
        .collect();
    let [staged, written] = &settings[..] else { panic!("{settings:?}") };
    assert!(staged.starts_with("40 a.settings.delay staged ") && staged.ends_with(">50ms"), "{staged}");
    assert!(written.contains("a.settings.delay written ") && written.ends_with(">50ms"), "{written}");
    // The block works by it.
    assert_eq!(told(&ran), ["150 a raised normal>active"]);
    assert_eq!(ran.kept["setting/a.settings.delay"], r#"{"file":"0s","value":"50ms"}"#);

    let again = plant("").after(&ran.kept).stimulus("100ms,field.a,true\n").run_for(300 * MS);
    // The alarm stood at the end of the first run; the second finds it gone.
    assert_eq!(
        told(&again),
        ["0 a returned active>normal", "150 a raised normal>active"],
        "the setting outlives the run"
    );
    assert!(again.records.iter().any(|r| r.source == "a.settings.delay" && r.transition == "restored"));
}

#[test]
fn a_setting_that_the_plant_file_has_changed_does_not_come_back() {
    let first = plant("").stimulus("40ms,a.settings.delay,50ms\n").run_for(100 * MS);
    // The plant file says something else now, which counts; then again what it said at first.
    let file = |delay: &str| {
        plant(&format!("[block.x]\ncomponent = \"digital-alarm\"\nlane = \"main\"\nsettings.delay = \"{delay}\"\n"))
    };
    let mut kept = first.kept;
    let value = kept.remove("setting/a.settings.delay").expect("it was kept");
    kept.insert("setting/x.settings.delay".into(), value);
    let changed = file("20ms").after(&kept).run_for(50 * MS);
    assert!(changed.records.iter().any(|r| r.source == "x.settings.delay" && r.transition == "replaced"));
    // What the run forgot is forgotten.
    assert!(!changed.kept.contains_key("setting/x.settings.delay"));
}
