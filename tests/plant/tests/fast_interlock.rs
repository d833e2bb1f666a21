//! examples/fast-interlock does what its page says: the order inside one interrupt, and each row of the table of what the
//! stimulus shows.

use latchwork_plant::assemble::Time;
use latchwork_record::Kind;
use latchwork_tests_plant::{Ran, Rig};
use std::path::Path;

const MS: u64 = 1_000_000;
const US: u64 = 1_000;

fn file(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/fast-interlock").join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn rig() -> Rig {
    let text = file("plant.toml");
    // The rig has its own [plant] with the folders of this build.
    let (_, rest) = text.split_once("[lane.main]").expect("the first lane");
    Rig::new(&format!("[lane.main]{rest}")).sim()
}

fn ran() -> Ran {
    let rows = file("stimulus.csv");
    rig().stimulus(rows.trim_start_matches("time,tag,value\n")).run_for(2000 * MS)
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
    let three = |class| [class; 3];
    let trip = [three("digital-input"), three("digital-alarm"), three("on-off"), three("digital-output")].concat();
    assert_eq!(classes("trip"), trip);
    let inputs = [three("digital-input"), three("digital-alarm")].concat();
    let outputs = [three("on-off"), three("digital-output")].concat();
    assert_eq!(classes("main"), [inputs, vec!["pco"], outputs].concat());
}

#[test]
fn every_row_of_the_page_happens() {
    let ran = ran();
    assert_eq!(ran.outcome.faulted.len(), 0);
    let changes = |tag: &str, from: u64, to: u64| -> Vec<(u64, bool)> {
        let of = ran.history(tag).into_iter().filter(|(time, _)| (from..to).contains(time));
        of.map(|(time, value)| (time, value == "true")).collect()
    };
    // The door opens in the middle of a scan of `main`: the shutter drops with the time of the edge.
    assert_eq!(changes("gpio.shutter", 100 * MS, 150 * MS), [(103_250 * US, false)]);
    // Beam is lost for 50 µs: the source is off, and stays off until its restart is allowed.
    assert_eq!(changes("gpio.source", 100 * MS, 240 * MS), [(103_300 * US, false)]);
    assert!(matches!(changes("gpio.source", 240 * MS, 270 * MS)[..], [(time, true)] if time >= 250 * MS));
    // After the acknowledgement the shutter opens.
    assert!(matches!(changes("gpio.shutter", 150 * MS, 290 * MS)[..], [(time, true)] if time >= 200 * MS));
    // A bouncing contact: four edges, four records.
    let door = ran.records.iter().filter(|r| r.source == "gpio.door" && r.kind == Kind::Event);
    let bounce: Vec<_> = door.map(|r| r.time).filter(|t| (302 * MS..303 * MS).contains(t)).collect();
    assert_eq!(bounce, [302_000 * US, 302_020 * US, 302_040 * US, 302_300 * US]);
    // The vacuum is bad for a while: the valve closes and opens by itself.
    assert_eq!(changes("gpio.valve", 400 * MS, 440 * MS), [(404_500 * US, false), (431_000 * US, true)]);
    // Low water for longer than the delay of 100 ms stops the pump, which is of the main lane.
    let pump = changes("gpio.pump", 500 * MS, 700 * MS);
    assert!(matches!(pump[..], [(time, false)] if (600 * MS..=620 * MS).contains(&time)), "{pump:?}");
    assert!(matches!(changes("gpio.pump", 700 * MS, 800 * MS)[..], [(time, true)] if time >= 750 * MS));
    // Blocked, the alarm lets the shutter open; unblocked with the door open, it drops.
    assert_eq!(changes("gpio.shutter", 1000 * MS, 1050 * MS), []);
    assert!(matches!(changes("gpio.shutter", 1050 * MS, 1070 * MS)[..], [(_, false)]));
    // The heater runs in the bake-out alone and pauses while it is too hot.
    let heater: Vec<bool> = changes("gpio.heater", MS, 1500 * MS).into_iter().map(|c| c.1).collect();
    assert_eq!(heater, [true, false, true]);
    // Two edges at the same nanosecond: two records, two trips.
    let last: Vec<_> = ran.records.iter().filter(|r| r.time == 1_600_500 * US && r.kind == Kind::Event).collect();
    for source in ["gpio.door", "gpio.beam"] {
        assert_eq!(last.iter().filter(|r| r.source == source).count(), 1, "{source}");
    }
    assert_eq!(changes("gpio.shutter", 1600 * MS, 2000 * MS), [(1_600_500 * US, false)]);
    assert_eq!(changes("gpio.source", 1600 * MS, 2000 * MS), [(1_600_500 * US, false)]);
}

#[test]
fn a_change_of_a_status_register_is_one_record_with_both_registers() {
    let ran = ran();
    let of = |source: &str| -> Vec<(String, String)> {
        let events = ran.records.iter().filter(|r| r.source == source && r.kind == Kind::Event);
        events.map(|r| (r.previous.to_string(), r.current.to_string())).collect()
    };
    for block in ["door", "door-open", "shutter", "shutter-out", "unit", "pump", "level-low"] {
        let changes = of(&format!("{block}.outputs.status"));
        assert!(changes.len() > 1, "{block}");
        assert!(changes.windows(2).all(|w| w[0].1 == w[1].0 && w[1].0 != w[1].1), "{block}: {changes:?}");
    }
    assert!(ran.records.windows(2).all(|w| w[0].time <= w[1].time), "in the order of time");
}
