//! examples/fast-interlock does what its page says: the order inside one interrupt, each row of the table of what the
//! stimulus shows, and what else stops its actuators.

use latchwork_plant::assemble::Time;
use latchwork_plant::lane::LaneState;
use latchwork_record::Kind;
use latchwork_tests_plant::{Ran, Rig};
use std::collections::HashMap;
use std::path::Path;

const MS: u64 = 1_000_000;
const US: u64 = 1_000;

fn file(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/fast-interlock").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The plant, with its text from `[lane.main]` on changed.
fn rig_with(change: impl FnOnce(String) -> String) -> Rig {
    let text = file("plant.toml");
    // The rig has its own [plant] with the folders of this build.
    let (_, rest) = text.split_once("[lane.main]").expect("the first lane");
    Rig::new(&change(format!("[lane.main]{rest}"))).sim()
}

fn rig() -> Rig {
    rig_with(|text| text)
}

fn ran() -> Ran {
    let rows = file("stimulus.csv");
    let ran = rig().stimulus(rows.trim_start_matches("time,tag,value\n")).run_for(2000 * MS);
    assert_eq!(ran.outcome.faulted.len(), 0);
    ran
}

/// When a bool changed, and to what, from one time to before another.
fn changes(ran: &Ran, tag: &str, from: u64, to: u64) -> Vec<(u64, bool)> {
    let of = ran.history(tag).into_iter().filter(|(time, _)| (from..to).contains(time));
    of.map(|(time, value)| (time, value == "true")).collect()
}

/// The only change of a bool from one time to before another: to true, with the scan of lane `trip` that is next after `at`.
#[track_caller]
fn assert_rises(ran: &Ran, tag: &str, from: u64, to: u64, at: u64) {
    let got = changes(ran, tag, from * MS, to * MS);
    assert!(
        matches!(got[..], [(time, true)] if (at * MS..(at + 10) * MS).contains(&time)),
        "{tag} after {at}: {got:?}"
    );
}

/// The flags of a block's status register at a time in ms, as ` a b c `.
fn status(ran: &Ran, block: &str, ms: u64) -> String {
    format!(" {} ", ran.at(&format!("{block}.outputs.status"), ms * MS).replace('|', " "))
}

/// Whether they are what `words` say, `!word` for what must not be.
#[track_caller]
fn assert_status(ran: &Ran, block: &str, ms: u64, words: &str) {
    let status = status(ran, block, ms);
    for word in words.split_whitespace() {
        let (name, wanted) = word.strip_prefix('!').map_or((word, true), |name| (name, false));
        assert_eq!(status.contains(&format!(" {name} ")), wanted, "{block} at {ms} ms: `{word}` in{status}");
    }
}

/// Edges of a line on record, µs.
fn edges(ran: &Ran, line: &str, from: u64, to: u64) -> Vec<u64> {
    let of = ran.records.iter().filter(|r| r.source == line && r.kind == Kind::Event && (from..to).contains(&r.time));
    of.map(|r| r.time / US).collect()
}

#[test]
fn the_order_inside_one_interrupt_is_that_of_the_paper() {
    let plant = rig().plant(Time::Virtual);
    let classes = |lane: &str| -> Vec<&str> {
        let index = plant.model.lanes.iter().position(|l| l.name == lane).expect("the lane");
        let blocks = plant.model.blocks.iter().filter(|b| b.lane == index);
        blocks
            .map(|b| b.class.name.trim_start_matches("latchwork:device/").split('@').next().unwrap_or_default())
            .collect()
    };
    let three = |class| vec![class; 3];
    let inputs = || [three("digital-input"), vec!["and"], three("digital-alarm")].concat();
    let outputs = || [vec!["or"], three("on-off"), three("digital-output")].concat();
    assert_eq!(classes("trip"), [inputs(), outputs()].concat());
    assert_eq!(classes("main"), [inputs(), vec!["pco"], outputs()].concat());
}

#[test]
fn what_the_page_says_of_start_and_restart() {
    let ran = ran();
    // Stopped until the operator has acknowledged and allowed the restart.
    for (block, line) in [("shutter", "gpio.shutter"), ("source", "gpio.source"), ("pump", "gpio.pump")] {
        assert_status(&ran, block, 29, "full-stop unacknowledged !output");
        assert_rises(&ran, line, 1, 100, 30);
        assert_status(&ran, block, 50, "output !full-stop !unacknowledged");
    }
    for block in ["door-open", "beam-lost", "vacuum-lost", "valve"] {
        assert_status(&ran, block, 29, "unacknowledged");
        assert_status(&ran, block, 50, "!unacknowledged");
    }
    // The valve and the dryer need nobody.
    assert_eq!(changes(&ran, "gpio.valve", 1, 100 * MS), [(6 * MS, true)]);
    assert_eq!(changes(&ran, "gpio.dryer", 0, 500 * MS), [(0, true)]);

    // The door opens in the middle of a scan of `main`: the shutter drops with the time of the edge.
    assert_eq!(changes(&ran, "gpio.shutter", 100 * MS, 150 * MS), [(103_250 * US, false)]);
    // Beam is lost for 50 µs: the source is off, and stays off.
    assert_eq!(edges(&ran, "gpio.beam", 100 * MS, 150 * MS), [103_300, 103_350]);
    assert_eq!(changes(&ran, "gpio.source", 100 * MS, 150 * MS), [(103_300 * US, false)]);
    // The door is shut; after the acknowledgement the shutter opens.
    assert_eq!(edges(&ran, "gpio.door", 150 * MS, 200 * MS), [160_000]);
    assert_rises(&ran, "gpio.shutter", 150, 300, 200);
    assert_status(&ran, "door-open", 199, "unacknowledged");
    assert_status(&ran, "door-open", 220, "!unacknowledged");
    // The source: an acknowledgement is not enough, the restart must be allowed.
    assert_status(&ran, "source", 209, "unacknowledged restart-needed");
    assert_status(&ran, "source", 249, "!unacknowledged restart-needed !output");
    assert_rises(&ran, "gpio.source", 150, 500, 250);
    // A bouncing contact: four edges, four records.
    assert_eq!(edges(&ran, "gpio.door", 300 * MS, 310 * MS), [302_000, 302_020, 302_040, 302_300]);
    assert_eq!(changes(&ran, "gpio.shutter", 300 * MS, 330 * MS), [(302_000 * US, false)]);
    assert_rises(&ran, "gpio.shutter", 310, 500, 330);
    // The vacuum is bad for a while: the valve closes and opens by itself.
    assert_eq!(changes(&ran, "gpio.valve", 100 * MS, 500 * MS), [(404_500 * US, false), (431_000 * US, true)]);
}

#[test]
fn what_the_page_says_of_the_unit_and_its_dependents() {
    let ran = ran();
    // Low water for longer than the delay of 100 ms stops the unit, and with it all that depends on it.
    assert_status(&ran, "level-low", 550, "pending !active");
    assert_status(&ran, "unit", 599, "run");
    assert_status(&ran, "unit", 600, "!run interlocked temporary-stop unacknowledged");
    for (line, at) in [("pump", 600), ("dryer", 600), ("shutter", 606), ("source", 606), ("valve", 606)] {
        let line = format!("gpio.{line}");
        assert_eq!(changes(&ran, &line, 500 * MS, 700 * MS), [(at * MS, false)], "{line}");
    }
    // It goes on by itself, and they with it, but the pump.
    assert_status(&ran, "unit", 700, "run !interlocked unacknowledged");
    for line in ["gpio.dryer", "gpio.shutter", "gpio.source", "gpio.valve"] {
        assert_rises(&ran, line, 700, 800, 700);
    }
    assert_rises(&ran, "gpio.pump", 700, 2000, 750);
    assert_status(&ran, "unit", 770, "!unacknowledged");

    // In manual mode the operator chooses the option mode: the heater runs in the bake-out and pauses while it is too hot.
    assert_status(&ran, "unit", 1199, "auto-mode mode1");
    assert_status(&ran, "unit", 1210, "manual-mode mode1");
    assert_status(&ran, "unit", 1230, "manual-mode mode2 run");
    let heater = [(1220 * MS, true), (1300 * MS, false), (1400 * MS, true)];
    assert_eq!(changes(&ran, "gpio.heater", 1, 2000 * MS), heater);
    // Mode 3 may not follow mode 2: refused, on record, until the unit is back in auto mode.
    let refused =
        ran.records.iter().find(|r| r.source == "unit.outputs.status" && r.time == 1450 * MS).expect("a record");
    assert_eq!((refused.kind, refused.text.as_str()), (Kind::Event, "+option-mode-refused"));
    assert_status(&ran, "unit", 1490, "mode2 !mode3 option-mode-refused");
    assert_status(&ran, "unit", 1510, "auto-mode mode2 !option-mode-refused");
}

#[test]
fn what_the_page_says_of_modes_blocks_and_forces() {
    let ran = ran();
    // In manual mode the door still stops the shutter, and an order given meanwhile is not kept.
    assert_status(&ran, "shutter", 799, "auto-mode output");
    assert_status(&ran, "shutter", 820, "manual-mode output");
    assert_eq!(changes(&ran, "gpio.shutter", 800 * MS, 920 * MS), [(853_300 * US, false)]);
    assert!(changes(&ran, "shutter.commands.on-order", 860 * MS, 880 * MS).iter().any(|(_, given)| *given));
    assert_status(&ran, "shutter", 870, "full-stop !manual-order");
    assert_eq!(edges(&ran, "gpio.door", 860 * MS, 900 * MS), [880_000]);
    assert_status(&ran, "shutter", 919, "manual-mode auto-order !manual-order !full-stop !interlocked");
    assert_rises(&ran, "gpio.shutter", 900, 1050, 920);
    assert_status(&ran, "shutter", 939, "manual-mode");
    assert_status(&ran, "shutter", 960, "auto-mode output");

    // Blocked, the alarm lets the door open, on record; unblocked with the door open, the shutter drops.
    assert_eq!(edges(&ran, "gpio.door", 1000 * MS, 1050 * MS), [1_013_700]);
    assert_status(&ran, "door-open", 1040, "blocked input active !interlock");
    let of_alarm = |r: &&latchwork_record::Record| r.source == "door-open.outputs.status";
    let of_alarm: Vec<_> = ran.records.iter().filter(of_alarm).map(|r| (r.time / US, r.text.as_str())).collect();
    assert!(of_alarm.contains(&(1_006_000, "+blocked")), "{of_alarm:?}");
    assert!(of_alarm.contains(&(1_013_700, "+input +active")), "{of_alarm:?}");
    assert_eq!(changes(&ran, "gpio.shutter", 1050 * MS, 1080 * MS), [(1056 * MS, false)]);
    assert_rises(&ran, "gpio.shutter", 1080, 1120, 1100);

    // Forced to shut, the door's input is an alarm as soon as the door opens.
    assert_status(&ran, "door", 1130, "forced position measured !forced-differs");
    assert_eq!(changes(&ran, "gpio.shutter", 1120 * MS, 1170 * MS), [(1_133_300 * US, false)]);
    assert_status(&ran, "door", 1140, "forced position !measured forced-differs");
    assert_eq!(edges(&ran, "gpio.door", 1140 * MS, 1160 * MS), [1_150_000]);
    assert_status(&ran, "door", 1169, "!forced position");
    assert_rises(&ran, "gpio.shutter", 1150, 1600, 1170);

    // Two edges at the same nanosecond: two records, two trips.
    for (line, output) in [("gpio.door", "gpio.shutter"), ("gpio.beam", "gpio.source")] {
        assert_eq!(edges(&ran, line, 1600 * MS, 2000 * MS), [1_600_500], "{line}");
        assert_eq!(changes(&ran, output, 1600 * MS, 2000 * MS), [(1_600_500 * US, false)], "{output}");
    }
}

#[test]
fn a_change_of_a_status_register_is_one_record_with_both_registers() {
    let ran = ran();
    let plant = rig().plant(Time::Virtual);
    let types: HashMap<&str, _> = plant.layout.tags.iter().map(|(_, t)| (t.name.as_str(), &t.ty)).collect();
    let registers: Vec<_> = plant.model.blocks.iter().map(|b| format!("{}.outputs.status", b.name)).collect();
    let registers: Vec<_> = registers.iter().filter(|name| types.contains_key(name.as_str())).collect();
    assert_eq!(registers.len(), 25, "all objects but the four of logic");
    for name in registers {
        // Each change of the tag, the first from nothing at all.
        let (mut expected, mut before) = (Vec::new(), String::new());
        for (time, now) in ran.history(name) {
            if now != before {
                expected.push((time, std::mem::replace(&mut before, now.to_owned()), now.to_owned()));
            }
        }
        let text = |datum: String| types[name.as_str()].format(datum.parse().expect("a register is a number"));
        let events = ran.records.iter().filter(|r| r.source == *name && r.kind == Kind::Event);
        let told: Vec<_> =
            events.map(|r| (r.time, text(r.previous.to_string()), text(r.current.to_string()))).collect();
        assert_eq!(told, expected, "{name}");
    }
    assert!(ran.records.windows(2).all(|w| w[0].time <= w[1].time), "in the order of time");
}

/// All is well from the start, the restart is allowed, and some blocks go to manual mode and are ordered on.
fn well_and_manual(blocks: &[&str]) -> String {
    let mut rows = String::new();
    for line in ["door", "beam", "vacuum", "level", "air", "heat"] {
        rows += &format!("0s,gpio.{line},true\n");
    }
    rows += "30ms,source.commands.allow-restart,true\n";
    for block in ["shutter", "source", "pump"] {
        rows += &format!("30ms,{block}.commands.acknowledge,true\n");
    }
    for block in blocks {
        rows += &format!("50ms,{block}.commands.manual-mode,true\n50ms,{block}.commands.on-order,true\n");
    }
    rows
}

#[test]
fn what_comes_back_after_an_acknowledgement_needs_one_after_any_start() {
    // Without their alarms, so that nothing but the start itself stops them.
    let without_alarms = |text: String| -> String {
        let lines = text.lines().filter(|line| !line.starts_with("inputs.full-stop"));
        lines.map(|line| format!("{line}\n")).collect()
    };
    let ran = rig_with(without_alarms).stimulus(&well_and_manual(&[])).run_for(100 * MS);
    for block in ["shutter", "source", "pump"] {
        assert_status(&ran, block, 29, "auto-order full-stop unacknowledged !output");
        assert_status(&ran, block, 50, "!full-stop output");
    }
}

#[test]
fn a_stop_of_the_unit_and_a_lost_thermostat_stop_the_dependents_also_in_manual_mode() {
    let mut rows = well_and_manual(&["shutter", "source", "valve", "dryer", "heater"]);
    rows += "100ms,heat.commands.force-true,true\n120ms,gpio.heat,false\n140ms,gpio.heat,true\n";
    rows += "200ms,gpio.level,false\n400ms,gpio.level,true\n";
    let ran = rig().stimulus(&rows).run_for(500 * MS);
    // Its input forced to well, the thermostat stops the heater all the same.
    assert_eq!(changes(&ran, "gpio.heater", 1, 200 * MS), [(50 * MS, true), (120 * MS, false), (140 * MS, true)]);
    for (block, stops) in [("shutter", 306), ("source", 306), ("valve", 306), ("dryer", 300), ("heater", 300)] {
        assert_status(&ran, block, 290, "manual-mode manual-order output");
        let expected = [(stops * MS, false), ((stops + 100) * MS, true)];
        assert_eq!(changes(&ran, &format!("gpio.{block}"), 200 * MS, 500 * MS), expected, "{block}");
    }
}

#[test]
fn a_fault_of_the_main_lane_stops_the_dependents_also_in_manual_mode() {
    // The scan that begins at 110 ms takes longer than the watchdog of 50 ms allows.
    let slow = format!("main = [{}\"60ms\"]", "\"6ms\", ".repeat(11));
    let rig = rig_with(|text| {
        assert!(text.contains("main = \"6ms\""));
        text.replace("main = \"6ms\"", &slow)
    });
    let blocks = ["shutter", "source", "valve"];
    let ran = rig.stimulus(&well_and_manual(&blocks)).run_for(500 * MS);
    assert_eq!(ran.outcome.lanes[0].state, LaneState::Faulted);
    assert_eq!(ran.outcome.lanes[1].state, LaneState::Stopped, "lane `trip` went on to the end");
    for block in blocks {
        assert_status(&ran, block, 169, "manual-mode manual-order output");
        assert_status(&ran, block, 170, "manual-mode manual-order !output interlocked temporary-stop");
        assert_eq!(changes(&ran, &format!("gpio.{block}"), 100 * MS, 500 * MS), [(170 * MS, false)], "{block}");
    }
}
