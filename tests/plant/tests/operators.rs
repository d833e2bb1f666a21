//! Operators at a running plant, by the machine's clock: every wish is answered, and on record with who and why.

use latchwork_plant::operate::{AlarmRow, Answer, Operation, Operator, Refused, TagRow};
use latchwork_record::{Kind, Record};
use latchwork_tests_plant::Rig;
use std::time::{Duration, Instant};

const PLANT: &str = r#"
[lane.main]
every = "5ms"
watchdog = "2s"
[driver.field]
kind = "sim"
[driver.field.points]
a = { type = "bool" }
shown = { type = "bool", from = "b.outputs.interlock" }
[block.a]
component = "digital-alarm"
lane = "main"
inputs.input = "field.a"
budget = "100ms"
[block.b]
component = "digital-alarm"
lane = "main"
inputs.input = { tag = "field.a", not = true }
budget = "100ms"
[block.on]
component = "on-off"
lane = "main"
budget = "100ms"
[[alarm]]
match = 'a\.alarms\.alarm'
code = 0xC400
[[alarm]]
match = 'on\.commands\.auto-mode'
code = 0xA080
"#;

struct Running(latchwork_tests_plant::Running);

impl Running {
    fn new(text: &str) -> Self {
        Self(latchwork_tests_plant::Running::start(&Rig::new(text).trace(None)))
    }

    fn ask(&self, operation: Operation) -> Result<Answer, Refused> {
        self.0.ask(operation, "commissioning")
    }

    fn tag(&self, name: &str) -> TagRow {
        match self.ask(Operation::Read { tags: vec![name.into()] }) {
            Ok(Answer::Tags(rows)) => rows[0].clone(),
            other => panic!("{other:?}"),
        }
    }

    fn alarm(&self, name: &str) -> AlarmRow {
        match self.ask(Operation::Alarms { all: true }) {
            Ok(Answer::Alarms(rows)) => rows.into_iter().find(|r| r.alarm == name).expect("the alarm"),
            other => panic!("{other:?}"),
        }
    }

    fn until(&self, what: &str, holds: impl Fn() -> bool) {
        let end = Instant::now() + Duration::from_secs(20);
        while !holds() {
            assert!(Instant::now() < end, "never: {what}");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Stops it; all records, and the names of what they kept.
    fn end(self) -> (Vec<Record>, Vec<String>) {
        let log = self.0.end();
        (log.records, log.kept.into_keys().collect())
    }
}

#[test]
fn a_shift_of_work() {
    let plant = Running::new(PLANT);
    let text = |s: &str| s.to_owned();

    // A force on an input that a block reads inverted: of its source, and the answer says so.
    let Ok(Answer::Done { done }) = plant.ask(Operation::Force { tag: text("b.inputs.input"), value: text("false") })
    else {
        panic!("not forced")
    };
    assert_eq!(done, ["field.a is held at true: `b.inputs.input` shows it"]);
    plant.until("the alarm", || plant.alarm("a.alarms.alarm").state == "unacknowledged");
    assert!(
        plant.tag("field.a").forced && plant.tag("a.inputs.input").forced && !plant.tag("b.outputs.interlock").forced
    );

    // What has been raised after the operator has looked is not acknowledged.
    let row = plant.alarm("a.alarms.alarm");
    let ack = |seen| plant.ask(Operation::Acknowledge { alarm: text("a.*"), seen: Some(seen) });
    let refused = ack(row.seq - 1).expect_err("an alarm nobody has seen");
    assert!(refused.reason == "state" && refused.message.contains("raised anew"), "{refused}");
    ack(row.seq).expect("it was seen");
    assert_eq!(plant.alarm("a.alarms.alarm").state, "active");

    // A force on an output holds it against its block.
    plant.ask(Operation::Force { tag: text("b.outputs.interlock"), value: text("true") }).expect("forced");
    plant.until("the output", || plant.tag("field.shown").value == serde_json::json!(true));
    let Ok(Answer::Forces(forces)) = plant.ask(Operation::Forces) else { panic!("no list") };
    assert_eq!(forces.iter().map(|f| f.tag.as_str()).collect::<Vec<_>>(), ["field.a", "b.outputs.interlock"]);
    assert!(forces.iter().all(|f| f.user == "anna" && f.since > 0));
    plant.ask(Operation::Unforce { tag: text("*") }).expect("taken away");
    plant.until("the return", || plant.alarm("a.alarms.alarm").state == "normal");

    // Settings: staged, looked at, written, read back; a value that does not fit, a tag that cannot be set.
    let set =
        |value: &str, write| plant.ask(Operation::Set { values: vec![(text("a.settings.delay"), text(value))], write });
    set("30ms", false).expect("staged");
    assert_eq!(plant.tag("a.settings.delay").value, serde_json::json!("0s"));
    let Ok(Answer::Tags(rows)) = plant.ask(Operation::ReadValues { block: text("a") }) else { panic!("no values") };
    assert!(
        rows.iter().any(|r| r.tag == "a.settings.delay (staged)" && r.value == serde_json::json!("30ms")),
        "{rows:?}"
    );
    plant.ask(Operation::WriteValues { block: text("a") }).expect("written");
    assert_eq!(plant.tag("a.settings.delay").value, serde_json::json!("30ms"));
    assert_eq!(plant.ask(Operation::WriteValues { block: text("a") }).expect_err("nothing is staged").reason, "state");
    assert_eq!(set("soon", true).expect_err("no duration").reason, "value");
    let wrong = plant.ask(Operation::Set { values: vec![(text("a.outputs.interlock"), text("true"))], write: true });
    assert_eq!(wrong.expect_err("an output").reason, "state");

    // Points of sim drivers are set; commands are given; unknown names have a hint.
    plant.ask(Operation::Set { values: vec![(text("field.a"), text("true"))], write: false }).expect("set");
    plant.until("the alarm again", || plant.alarm("a.alarms.alarm").state == "unacknowledged");
    plant.ask(Operation::Command { tag: text("on.commands.auto-mode"), on: Some(true) }).expect("a retained command");
    plant.until("the command", || plant.tag("on.commands.auto-mode").value == serde_json::json!(true));
    plant.ask(Operation::Command { tag: text("a.commands.acknowledge"), on: None }).expect("a one-shot");
    let unknown = plant.ask(Operation::Command { tag: text("a.commands.acknowlege"), on: None }).expect_err("a slip");
    assert!(unknown.message.contains("did you mean `a.commands.acknowledge`?"), "{unknown}");

    // What the policy forbids is not done, and on record.
    let operator = Operator { user: "eve".into(), origin: "api".into(), reason: String::new() };
    let force = Operation::Force { tag: text("field.a"), value: text("false") };
    let forbidden = plant.0.console().ask(operator, force, Some("no right to force".into()), Duration::from_secs(20));
    assert_eq!(forbidden.expect_err("forbidden").reason, "forbidden");

    let Ok(Answer::Status(status)) = plant.ask(Operation::Status) else { panic!("no status") };
    assert_eq!((&status["plant"], &status["alarms"]["unacknowledged"]), (&"test".into(), &1.into()));

    let (records, kept) = plant.end();
    let who: Vec<_> = records
        .iter()
        .filter(|r| !r.user.is_empty())
        .map(|r| format!("{} {} {} {}", r.kind.name(), r.source, r.transition, r.user))
        .collect();
    let expected = [
        "audit field.a forced anna",
        "command a.* refused anna",
        "alarm a.alarms.alarm acknowledged anna",
        "audit b.outputs.interlock forced anna",
        "audit field.a unforced anna",
        "audit b.outputs.interlock unforced anna",
        "setting a.settings.delay staged anna",
        "setting a.settings.delay written anna",
        "setting a refused anna",
        "setting a.settings.delay refused anna",
        "setting a.outputs.interlock refused anna",
        "audit field.a set anna",
        "command on.commands.auto-mode on anna",
        "command a.commands.acknowledge given anna",
        "command a.commands.acknowlege refused anna",
        "audit field.a refused eve",
    ];
    assert_eq!(who, expected);
    let forced = records.iter().find(|r| r.transition == "forced").expect("a force");
    assert_eq!(forced.text, "from cli; because commissioning");
    assert!(records.iter().filter(|r| r.kind == Kind::Alarm && r.transition == "raised").count() >= 2);
    for name in ["command/on.commands.auto-mode", "setting/a.settings.delay"] {
        assert!(kept.iter().any(|k| k == name), "{kept:?}");
    }
}
