//! Versions with other ports than the plant was laid out with: by name in the lane, and with tags at once.

use latchwork_plant::operate::{Answer, Operation, Refused};
use latchwork_plant::swap::{Part, Stage, SwapOrder, SwapStatus, WayBack};
use latchwork_record::{Kind, Record};
use latchwork_tests_plant::Rig;
use latchwork_tests_plant::forge::component;
use std::sync::LazyLock;

const MS: u64 = 1_000_000;

/// One version of `test:ports/unit`: its WIT, and what it executes on its own arguments.
///
/// All of them give `x` = a · gain and count the commands `go` in their state.
struct Version {
    wit: String,
    wat: String,
}

static FIRST: LazyLock<Version> = LazyLock::new(|| Version {
    wit: "record settings { gain: f64 }
record inputs { a: f64 }
flags commands { go }
record outputs { x: f64 }
flags alarms { high }
record retained { count: u32 }"
        .into(),
    wat: r#"
(func (export "test:ports/unit#configure") (param f64) (result i32) (global.set $gain (local.get 0)) (i32.const 16))
(func (export "test:ports/unit#save") (result i32) (global.get $count))
(func (export "test:ports/unit#restore") (param i32) (global.set $count (local.get 0)))
(func (export "test:ports/unit#execute") (param i64 i64 i32 f64 i32) (result i32)
  (global.set $count (i32.add (global.get $count) (i32.and (local.get 4) (i32.const 1))))
  (f64.store (i32.const 64) (f64.mul (local.get 3) (global.get $gain)))
  (i32.store8 (i32.const 72) (f64.gt (local.get 3) (f64.const 10)))
  (i32.const 64))"#
        .into(),
});

/// Other order, and more of everything: an input and an output with quality, a status register, a count with a wider type, a
/// setting, a command in the place of the other one, an alarm likewise.
static SECOND: LazyLock<Version> = LazyLock::new(|| Version {
    wit: "record settings { bias: f64, gain: f64 }
record inputs { e: real-signal, a: f64 }
flags commands { stop, go }
flags status-flags { odd, seen }
record outputs { y: real-signal, count: u32, seen: u8, status: status-flags, x: f64 }
flags alarms { low, high }
record retained { count: u64 }"
        .into(),
    wat: r#"
(func (export "test:ports/unit#configure") (param f64 f64) (result i32)
  (if (f64.lt (local.get 0) (f64.const 0)) (then (return (i32.const 32))))
  (global.set $bias (local.get 0)) (global.set $gain (local.get 1)) (i32.const 16))
(func (export "test:ports/unit#defaults") (result i32)
  (f64.store (i32.const 128) (f64.const 7)) (f64.store (i32.const 136) (f64.const 1)) (i32.const 128))
(func (export "test:ports/unit#save") (result i64) (i64.extend_i32_u (global.get $count)))
(func (export "test:ports/unit#restore") (param i64) (global.set $count (i32.wrap_i64 (local.get 0))))
(func (export "test:ports/unit#execute") (param i64 i64 i32 f64 i32 f64 i32) (result i32)
  (if (i32.and (local.get 6) (i32.const 1)) (then (global.set $count (i32.const 0))))
  (if (i32.and (local.get 6) (i32.const 2)) (then (global.set $count (i32.add (global.get $count) (i32.const 1)))))
  (f64.store (i32.const 64) (f64.add (local.get 3) (global.get $bias)))
  (i32.store8 (i32.const 72) (i32.const 1))
  (i32.store (i32.const 80) (global.get $count))
  (i32.store8 (i32.const 84) (local.get 4))
  (i32.store8 (i32.const 85) (i32.and (global.get $count) (i32.const 1)))
  (f64.store (i32.const 88) (f64.mul (local.get 5) (global.get $gain)))
  (i32.store8 (i32.const 96) (i32.or (f64.lt (local.get 5) (f64.const 1))
    (i32.shl (f64.gt (local.get 5) (f64.const 10)) (i32.const 1))))
  (i32.const 64))"#
        .into(),
});

/// Without input, alarms and commands, and without `x`.
static THIRD: LazyLock<Version> = LazyLock::new(|| Version {
    wit: "record settings { gain: f64 }
record outputs { count: u32, y: real-signal }
record retained { count: u32 }"
        .into(),
    wat: r#"
(func (export "test:ports/unit#configure") (param f64) (result i32) (global.set $gain (local.get 0)) (i32.const 16))
(func (export "test:ports/unit#save") (result i32) (global.get $count))
(func (export "test:ports/unit#restore") (param i32) (global.set $count (local.get 0)))
(func (export "test:ports/unit#execute") (param i64 i64 i32) (result i32)
  (i32.store (i32.const 64) (global.get $count))
  (f64.store (i32.const 72) (global.get $gain))
  (i32.const 64))"#
        .into(),
});

impl Version {
    fn component(&self) -> Vec<u8> {
        let has = |what: &str| self.wit.contains(what);
        let inputs = if has("inputs") { ", inputs: inputs" } else { "" };
        let commands = if has("commands") { ", commands: commands" } else { "" };
        let result = if has("alarms") { "tuple<outputs, alarms>" } else { "outputs" };
        let defaults = if self.wat.contains("#defaults") { "defaults: func() -> settings;" } else { "" };
        let wit = format!(
            "package test:ports;\ninterface unit {{\nuse latchwork:block/types@0.1.0.{{scan, real-signal}};\n{}\n\
             configure: func(settings: settings) -> result<_, string>;\n{defaults}\n\
             execute: func(scan: scan{inputs}{commands}) -> {result};\n\
             save: func() -> retained;\nrestore: func(state: retained);\n}}\nworld w {{ export unit; }}\n",
            self.wit
        );
        let wat = format!(
            r#"(module (memory (export "memory") 1)
(data (i32.const 32) "\01\00\00\00\30\00\00\00\0f\00\00\00") (data (i32.const 48) "bias is too low")
(global $count (mut i32) (i32.const 0)) (global $gain (mut f64) (f64.const 1)) (global $bias (mut f64) (f64.const 0))
(func (export "cabi_realloc") (param i32 i32 i32 i32) (result i32) (i32.const 1024))
{})"#,
            self.wat
        );
        component(&wit, &wat)
    }

    /// The same, which traps when `a` is more than 100; of the second version.
    fn trapping_beyond_100(&self) -> Self {
        let (before, body) = self.wat.split_once("i32) (result i32)\n  (if (i32.and (local.get 6)").expect("its body");
        let trap = "(if (f64.gt (local.get 5) (f64.const 100)) (then unreachable))";
        let wat = format!("{before}i32) (result i32)\n{trap}\n  (if (i32.and (local.get 6){body}");
        Self { wit: self.wit.clone(), wat }
    }

    fn order(&self, block: &str) -> SwapOrder {
        let part = Part {
            block: block.into(),
            file: "next.wasm".into(),
            bytes: self.component().into(),
            settings: Vec::new(),
            expects: None,
        };
        SwapOrder {
            parts: vec![part],
            shadow: 0,
            tolerances: Vec::new(),
            probation: 5,
            // The second version's count is wider.
            allow_lossy: true,
            dry_run: false,
            save: false,
        }
    }

    fn swap(&self) -> Operation {
        Operation::Swap(Box::new(self.order("unit")))
    }
}

const PLANT: &str = r#"
[lane.main]
every = "10ms"
[driver.field]
kind = "sim"
[driver.field.points]
a = { type = "f64" }
[block.unit]
component = "first.wasm"
lane = "main"
inputs.a = "field.a"
settings.gain = 2.0
[block.after]
component = "first.wasm"
lane = "main"
inputs.a = "unit.outputs.x"
settings.gain = 10.0
"#;

struct Told {
    answers: Vec<Result<Answer, Refused>>,
    records: Vec<Record>,
}

/// Runs the plant for 500 ms with wishes at their times, ms.
fn run(steps: Vec<(u64, Operation)>) -> Told {
    run_plant(PLANT, steps)
}

fn run_plant(text: &str, steps: Vec<(u64, Operation)>) -> Told {
    let rig = Rig::new(text).trace(None).with("first", &FIRST.component());
    let steps = steps.into_iter().map(|(ms, operation)| (ms * MS, operation)).collect();
    let (answers, log) = rig.operated(500 * MS, steps);
    Told { answers, records: log.records }
}

fn read(tags: &[&str]) -> Operation {
    Operation::Read { tags: tags.iter().map(|t| (*t).to_owned()).collect() }
}

fn set(tag: &str, value: &str) -> Operation {
    Operation::Set { values: vec![(tag.into(), value.into())], write: true }
}

fn go(tag: &str) -> Operation {
    Operation::Command { tag: tag.into(), on: None }
}

impl Told {
    /// Rows of an answer as `tag value quality`, without the block's name.
    fn rows(&self, at: usize) -> Vec<String> {
        match &self.answers[at] {
            Ok(Answer::Tags(rows)) => rows
                .iter()
                .map(|r| format!("{} {} {}", r.tag.strip_prefix("unit.").unwrap_or(&r.tag), r.value, r.quality))
                .collect(),
            other => panic!("{other:?}"),
        }
    }

    fn swaps(&self, at: usize) -> Vec<SwapStatus> {
        match &self.answers[at] {
            Ok(Answer::Swaps(all)) => all.clone(),
            other => panic!("{other:?}"),
        }
    }

    fn of(&self, kind: Kind) -> Vec<String> {
        let of_kind = self.records.iter().filter(|r| r.kind == kind);
        of_kind.map(|r| format!("{} ms {} {}", r.time / MS, r.source, r.transition)).collect()
    }
}

#[test]
fn a_version_with_other_ports_gets_and_gives_by_name() {
    let told = run(vec![
        (20, set("field.a", "3")),
        (40, go("unit.commands.go")),
        (60, go("unit.commands.go")),
        (100, read(&["unit.outputs.x", "after.outputs.x"])),
        (110, SECOND.swap()),
        (150, go("unit.commands.go")),
        (200, read(&["unit.outputs.*", "after.outputs.x"])),
        (210, set("field.a", "11")),
        (230, read(&["unit.outputs.x", "unit.alarms.*", "after.outputs.x"])),
    ]);
    assert_eq!(told.rows(3), ["outputs.x 6.0 good", "after.outputs.x 60.0 good"]);
    // Not wired: 0 with quality bad (2), which `seen` repeats; its own output is uncertain.
    assert_eq!(
        told.rows(6),
        [
            "outputs.x 6.0 good",
            "after.outputs.x 60.0 good",
            "outputs.y 7.0 uncertain",
            "outputs.count 3 good",
            "outputs.seen 2 good",
            "outputs.status \"odd\" good",
        ]
    );
    assert_eq!(
        told.rows(8),
        ["outputs.x 22.0 good", "alarms.high true good", "after.outputs.x 220.0 good", "alarms.low false good"]
    );
}

#[test]
fn what_comes_with_a_version_can_be_set_commanded_and_held_and_makes_records() {
    let told = run(vec![
        (20, set("field.a", "3")),
        (50, read(&["unit.settings.*", "unit.commands.*"])),
        (60, SECOND.swap()),
        (100, read(&["unit.settings.*", "unit.commands.*", "unit.inputs.*"])),
        (110, set("unit.settings.bias", "20")),
        (130, go("unit.commands.go")),
        (150, read(&["unit.outputs.y", "unit.outputs.count"])),
        (160, go("unit.commands.stop")),
        (180, read(&["unit.outputs.count"])),
        (190, Operation::Force { tag: "unit.outputs.count".into(), value: "99".into() }),
        (220, read(&["unit.outputs.count"])),
        (230, Operation::Unforce { tag: "unit.outputs.count".into() }),
        (250, read(&["unit.outputs.count"])),
        (260, set("unit.settings.bias", "-1")),
        (280, set("field.a", "0.5")),
        (300, Operation::Alarms { all: false }),
        (310, set("field.a", "5")),
    ]);
    assert_eq!(told.rows(1), ["commands.go false good", "settings.gain 2.0 good"]);
    assert_eq!(
        told.rows(3),
        [
            "inputs.a 3.0 good",
            "commands.go false good",
            "settings.gain 2.0 good",
            "inputs.e 0.0 good",
            "commands.stop false good",
            "settings.bias 7.0 good",
        ]
    );
    assert_eq!(told.rows(6), ["outputs.y 20.0 uncertain", "outputs.count 1 good"]);
    assert_eq!(told.rows(8), ["outputs.count 0 good"]);
    assert_eq!(told.rows(10), ["outputs.count 99 good"]);
    assert_eq!(told.rows(12), ["outputs.count 0 good"]);
    let refused = told.answers[13].as_ref().expect_err("a setting the block does not take");
    assert!(refused.message.contains("bias is too low"), "{refused}");
    match &told.answers[15] {
        Ok(Answer::Alarms(alarms)) => {
            let low = alarms.iter().find(|a| a.alarm == "unit.alarms.low").expect("the alarm");
            assert_eq!((low.state, low.quality), ("active", "good"));
        }
        other => panic!("{other:?}"),
    }
    let of_unit = |kind, what: &str| told.of(kind).into_iter().filter(|t| t.contains(what)).collect::<Vec<_>>();
    assert_eq!(
        of_unit(Kind::Alarm, "unit.alarms"),
        ["290 ms unit.alarms.low raised", "320 ms unit.alarms.low returned"]
    );
    assert_eq!(
        of_unit(Kind::Event, "unit.outputs.status"),
        ["140 ms unit.outputs.status changed", "170 ms unit.outputs.status changed"]
    );
}

/// A plant in which nobody uses what the unit has.
const LOOSE: &str = r#"
[lane.main]
every = "10ms"
[block.unit]
component = "first.wasm"
lane = "main"
on-fault = "safe"
safe.x = 5.0
settings.gain = 2.0
"#;

#[test]
fn what_a_version_does_not_have_is_bad_until_one_has_it_again() {
    let all = || read(&["unit.outputs.*", "unit.alarms.*"]);
    let told = run_plant(
        LOOSE,
        vec![
            (20, go("unit.commands.go")),
            (50, SECOND.swap()),
            (120, all()),
            (130, THIRD.swap()),
            (200, all()),
            (210, Operation::Rollback { block: "unit".into(), to: WayBack::Steps(2) }),
            (300, all()),
        ],
    );
    assert_eq!(
        told.rows(2),
        [
            "outputs.x 0.0 good",
            "alarms.high false good",
            "outputs.y 7.0 uncertain",
            "outputs.count 1 good",
            "outputs.seen 2 good",
            "outputs.status \"odd\" good",
            "alarms.low true good",
        ]
    );
    assert_eq!(
        told.rows(4),
        [
            "outputs.x 0.0 bad",
            "alarms.high false bad",
            "outputs.y 2.0 good",
            "outputs.count 1 good",
            "outputs.seen 2 bad",
            "outputs.status \"odd\" bad",
            "alarms.low false bad",
        ]
    );
    assert_eq!(
        told.rows(6),
        [
            "outputs.x 0.0 good",
            "alarms.high false good",
            "outputs.y 2.0 bad",
            "outputs.count 1 bad",
            "outputs.seen 2 bad",
            "outputs.status \"odd\" bad",
            "alarms.low false bad",
        ]
    );
}

#[test]
fn ports_come_once_however_often_versions_change() {
    let tags = || read(&["unit.*"]);
    let told = run_plant(
        LOOSE,
        vec![
            (20, SECOND.swap()),
            (100, tags()),
            (110, FIRST.swap()),
            (200, go("unit.commands.go")),
            (210, SECOND.swap()),
            (300, tags()),
            (310, read(&["unit.outputs.count"])),
        ],
    );
    let names =
        |at| told.rows(at).iter().map(|r| r.split(' ').next().unwrap_or_default().to_owned()).collect::<Vec<_>>();
    assert_eq!(names(1), names(5));
    assert_eq!(told.rows(6), ["outputs.count 1 good"]);
    let alarms = told.of(Kind::Alarm);
    assert_eq!(
        alarms,
        ["30 ms unit.alarms.low raised", "120 ms unit.alarms.low returned", "220 ms unit.alarms.low raised",]
    );
}

#[test]
fn a_fault_on_probation_takes_back_what_came_with_the_version() {
    let traps = SECOND.trapping_beyond_100();
    let mut order = traps.order("unit");
    order.probation = 1000;
    let told = run(vec![
        (20, set("field.a", "3")),
        (40, Operation::Swap(Box::new(order))),
        (100, read(&["unit.outputs.x", "unit.outputs.y", "unit.outputs.count"])),
        (110, set("field.a", "200")),
        (130, read(&["unit.outputs.x", "after.outputs.x", "unit.outputs.y", "unit.outputs.count"])),
    ]);
    assert_eq!(told.rows(2), ["outputs.x 6.0 good", "outputs.y 7.0 uncertain", "outputs.count 0 good"]);
    assert_eq!(
        told.rows(4),
        ["outputs.x 400.0 good", "after.outputs.x 4000.0 good", "outputs.y 7.0 bad", "outputs.count 0 bad"]
    );
}

#[test]
fn after_probation_new_outputs_follow_the_fault_policy_and_the_restart() {
    let traps = SECOND.trapping_beyond_100();
    let all = || read(&["unit.outputs.x", "unit.outputs.y", "unit.outputs.count"]);
    let told = run(vec![
        (20, set("field.a", "3")),
        (40, traps.swap()),
        (110, set("field.a", "200")),
        (130, all()),
        (140, set("field.a", "4")),
        (300, go("unit.commands.go")),
        (320, all()),
    ]);
    assert_eq!(told.rows(3), ["outputs.x 0.0 bad", "outputs.y 0.0 bad", "outputs.count 0 bad"]);
    assert_eq!(told.rows(6), ["outputs.x 8.0 good", "outputs.y 7.0 uncertain", "outputs.count 1 good"]);
}

#[test]
fn without_room_for_its_ports_a_version_is_refused_before_anything_is_touched() {
    let many: Vec<_> = (0..200).map(|i| format!("o{i}: u8")).collect();
    let wit = FIRST.wit.replace("x: f64", &format!("x: f64, {}", many.join(", ")));
    let wide = Version { wit, wat: FIRST.wat.replace("(i32.const 72)", "(i32.const 272)") };
    let mut dry = wide.order("unit");
    dry.dry_run = true;
    let told = run(vec![
        (20, set("field.a", "3")),
        (40, Operation::Swap(Box::new(dry))),
        (60, wide.swap()),
        (80, Operation::Swaps { number: None }),
        (100, read(&["unit.*"])),
        (110, SECOND.swap()),
        (200, read(&["unit.outputs.count"])),
    ]);
    let swaps = told.swaps(3);
    for swap in &swaps {
        assert_eq!(swap.stage, Stage::Refused);
        assert_eq!(
            swap.message,
            "there is room for 128 more of the 200 cells of outputs and alarms that come with it; start the plant anew with the \
             new version: then it is laid out for it"
        );
    }
    assert_eq!(swaps.len(), 2);
    assert_eq!(told.rows(4).len(), 5);
    // There is for another.
    assert_eq!(told.rows(6), ["outputs.count 0 good"]);
}

#[test]
fn a_plan_says_which_qualities_the_plant_does_not_know_yet() {
    let wit = FIRST.wit.replace("a: f64", "a: real-signal").replace("x: f64", "x: real-signal");
    let wat = FIRST.wat.replace("f64 i32) (result i32)", "f64 i32 i32) (result i32)");
    let mut dry = Version { wit, wat }.order("unit");
    dry.dry_run = true;
    let told = run(vec![(20, Operation::Swap(Box::new(dry))), (50, Operation::Swaps { number: None })]);
    let swaps = told.swaps(1);
    assert_eq!(swaps[0].stage, Stage::Planned, "{}", swaps[0].message);
    assert_eq!(
        swaps[0].blocks[0].notes,
        [
            "`unit.inputs.a` asks for a quality now; it is told good until the plant is started anew",
            "`unit.outputs.x` has its own quality now; it is shown with the block's until the plant is started anew",
        ]
    );
}

#[test]
fn a_plan_says_which_inputs_nobody_wires_yet() {
    let mut dry = SECOND.order("unit");
    dry.dry_run = true;
    let told = run(vec![(20, Operation::Swap(Box::new(dry))), (50, Operation::Swaps { number: None })]);
    let swaps = told.swaps(1);
    assert_eq!(swaps[0].stage, Stage::Planned, "{}", swaps[0].message);
    assert_eq!(
        swaps[0].blocks[0].notes,
        ["`unit.inputs.e` is new: it reads 0 until a plant file wires it, a signal with quality bad"]
    );
}
