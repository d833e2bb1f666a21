//! When states are saved, and what it costs.

use super::{MS, PLANT, S, count, plant};
use latchwork_plant::assemble::Time;
use latchwork_plant::lane::PUT_OFF;
use latchwork_tests_plant::Rig;

#[test]
fn every_interval_and_the_stop_save_what_has_changed() {
    let ran = plant().run_for(3500 * MS);
    let counts: Vec<_> = ran.saves.iter().map(|s| ["a", "b", "c"].map(|b| count(s, b))).collect();
    // Scans at 0 ms, 10 ms, …: the request at 1 s is taken by the scan of that time, and saved after it.
    assert_eq!(counts, [[101, 102, 103], [201, 202, 203], [301, 302, 303], [350; 3]]);
    assert!(ran.saves.iter().all(|s| !s.blocks.contains_key("not-kept")));
    assert_eq!((ran.figures.rounds, ran.figures.writes), (3, 4), "three rounds and the stop");
}

#[test]
fn at_most_one_block_is_saved_per_scan() {
    let ran = plant().run_for(1500 * MS);
    let times: Vec<_> = ["a", "b", "c"].map(|b| ran.saves[0].blocks[b].time / MS).into();
    assert_eq!(times, [1000, 1010, 1020]);
}

#[test]
fn a_round_in_which_nothing_has_changed_writes_nothing() {
    let ran = plant().stimulus("1500ms,field.stand,true\n").run_for(10_500 * MS);
    assert_eq!(ran.figures.rounds, 10);
    assert_eq!(ran.figures.writes, 2, "the last change, and no stop after it");
    // Two of ten rounds wrote a block of 4 KiB each.
    assert_eq!(ran.figures.bytes_a_day(S), Some(86_400 * 4096 / 5));
    assert_eq!(ran.saves[1].blocks["a"].time, 2 * S, "the time at which it was saved with these values first");
}

#[test]
fn a_plant_that_retains_nothing_keeps_nothing() {
    let ran = Rig::new(&PLANT.replace("retain = true", "")).run_for(3 * S);
    assert_eq!((ran.figures.writes, ran.saves.len()), (0, 0));
}

#[test]
fn without_an_interval_it_is_a_minute() {
    let ran = Rig::new(&PLANT.replace("[retain]\nevery = \"1s\"", "")).run_for(150 * S);
    assert_eq!((ran.figures.rounds, ran.saves[0].blocks["a"].time), (2, 60 * S));
}

#[test]
fn a_lane_without_time_puts_a_save_off_but_not_for_ever() {
    // Every scan takes the whole period.
    let rig = Rig::new(&format!("{PLANT}[sim.scan-time]\nmain = \"10ms\"\n")).sim();
    let ran = rig.run_for(5 * S);
    // Rounds begin anew while this one is under way: what was saved so far is kept with each of them.
    let first = |block| ran.saves.iter().find_map(|s| s.blocks.get(block)).expect("it is saved").time;
    let times = ["a", "b", "c"].map(first);
    assert_eq!(times[0], S + PUT_OFF, "taken at 1 s");
    assert!(times[1] >= times[0] + PUT_OFF && times[2] >= times[1] + PUT_OFF, "{times:?}");
    assert!(times[2] <= S + 3 * (PUT_OFF + 20 * MS), "{times:?}");
    let bare = Rig::new(&format!("{}[sim.scan-time]\nmain = \"10ms\"\n", PLANT.replace("retain = true", ""))).sim();
    let scans = bare.run_for(5 * S).outcome.lanes[0].statistics.scans;
    assert_eq!(ran.outcome.lanes[0].statistics.scans, scans, "no scan is missed for it");
    // With time left it is not put off.
    let ran = Rig::new(&format!("{PLANT}[sim.scan-time]\nmain = \"5ms\"\n")).sim().run_for(3 * S);
    assert_eq!(ran.saves[0].blocks["a"].time, S + 5 * MS, "after its scan");
}

#[test]
fn a_lane_that_is_slow_does_not_keep_the_others_from_being_kept() {
    let slow = r#"
        [lane.slow]
        every = "20s"
        [block.d]
        component = "keeper-probe"
        lane = "slow"
        retain = true
        inputs.count = true
        "#;
    let ran = Rig::new(&format!("{PLANT}{slow}")).run_for(30 * S);
    let first = &ran.saves[0];
    assert!(!first.blocks.contains_key("d") && first.blocks["a"].time == S, "{first:?}");
    let with = ran.saves.iter().find(|s| s.blocks.contains_key("d")).expect("it is saved in the end");
    assert_eq!(with.blocks["d"].time, 20 * S);
}

const EDGES: &str = r#"
[retain]
every = "1s"
[lane.main]
every = "10ms"
[lane.trip]
on = ["gpio.door"]
[driver.gpio]
kind = "sim"
points.door = { type = "bool" }
[block.main]
component = "keeper-probe"
lane = "main"
[block.edges]
component = "keeper-probe"
lane = "trip"
retain = true
inputs.count = true
"#;

#[test]
fn blocks_of_an_interrupt_lane_are_saved_although_no_edge_comes() {
    let ran = Rig::new(EDGES).stimulus("100ms,gpio.door,true\n200ms,gpio.door,false\n").run_for(5 * S);
    // Its first execution needs no edge.
    assert_eq!(ran.saves.len(), 1, "nothing has changed since");
    assert_eq!((count(&ran.saves[0], "edges"), ran.saves[0].blocks["edges"].time), (3, S));
    let on = Rig::new(EDGES).retained(ran.left()).run_for(500 * MS);
    assert_eq!(on.at("edges.outputs.count", 400 * MS), "4");
}

#[test]
fn a_polling_lane_too() {
    let text = EDGES.replace("on = [\"gpio.door\"]", "on = [\"gpio.door\"]\npoll = \"5ms\"");
    let ran = Rig::new(&text).stimulus("100ms,gpio.door,true\n").run_for(1500 * MS);
    assert_eq!(count(&ran.saves[0], "edges"), 2);
}

/// By the machine's clock, in one lane that is driven here: what a save costs is measured and not the scan's.
#[test]
fn the_cost_of_a_save_is_shown_and_not_part_of_the_scan() {
    use latchwork_plant::lane::{Report, Request, Save, SaveResult};
    use std::cell::Cell;
    let mut plant = plant().plant(Time::Virtual);
    let clock = Cell::new(0u64);
    // A clock that goes on by 7 us whenever somebody looks.
    let tick = || {
        clock.set(clock.get() + 7000);
        clock.get()
    };
    for scan in 0..5u64 {
        clock.set(scan * 10 * MS);
        if scan == 2 {
            let save = Save { block: 1, version: 0, cells: [0, 0].into() };
            assert!(plant.supervisor.send(0, Request::Save(save)).is_ok());
        }
        plant.lanes[0].scan(scan * 10 * MS, scan * 10 * MS, tick);
        plant.lanes[0].spare((scan + 1) * 10 * MS, tick);
    }
    assert_eq!(plant.lanes[0].statistics().scan_time_max, 7000);
    let Ok(Report::Saved(saved)) = plant.supervisor.lanes[0].reports.pop() else { panic!("no answer") };
    assert_eq!((saved.result, saved.save.version, saved.took), (SaveResult::Saved, 0, 7000));
    assert_eq!(saved.save.cells[..], [3, 3]);
    assert_eq!(saved.time, 20 * MS + 14_000, "after the scan");
}
