//! What a lane does about its own time: overruns, the watchdog, an orderly stop. Time is an argument, so nothing waits.

use latchwork_image::Quality;
use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::LaneState;
use latchwork_plant::model::TagRef;
use latchwork_record::Turn;
use latchwork_tests_plant::Rig;

const MS: u64 = 1_000_000;

const PLANT: &str = r#"
[lane.main]
every = "10ms"
watchdog = "50ms"
[block.latch]
component = "sr"
lane = "main"
inputs.s1 = true
safe.q1 = false
"#;

fn plant() -> Plant {
    Rig::new(PLANT).trace(None).plant(Time::Virtual)
}

/// Scans that take the given times, ms, each begun when it was due or when the one before ended.
fn scans(plant: &mut Plant, times: &[u64]) {
    let mut now = 0;
    for (n, time) in times.iter().enumerate() {
        let due = n as u64 * 10 * MS;
        let begin = due.max(now);
        now = begin + time * MS;
        plant.lanes[0].scan(due, begin, || now);
    }
}

fn records(plant: &mut Plant) -> Vec<String> {
    let mut seen = Vec::new();
    plant.router.collect();
    while let Some(Turn::Entry(entry)) = plant.router.next(u64::MAX) {
        let draft = plant.router.draft(&entry);
        seen.push(format!("{} {} {}", draft.source, draft.transition, draft.text));
    }
    seen
}

fn output(plant: &Plant) -> (u64, Quality) {
    let mut view = plant.view(&[plant.layout.ids[&TagRef::Output { block: 0, port: 0 }]]);
    view.refresh();
    (view.cell(0), view.quality(0))
}

#[test]
fn an_overrun_is_counted_and_the_lane_goes_on() {
    let mut plant = plant();
    scans(&mut plant, &[1, 12, 1, 1]);
    let lane = &plant.lanes[0];
    assert_eq!(lane.state(), LaneState::Running);
    // The scan after it began late, but ended before the next was due.
    assert_eq!((lane.statistics().scans, lane.statistics().overruns), (4, 1));
    assert_eq!(lane.statistics().scan_time_max, 12 * MS);
    assert_eq!(lane.statistics().jitter_max, 2 * MS);
    assert_eq!(output(&plant), (1, Quality::Good));
    let said = records(&mut plant);
    assert_eq!(said.len(), 2, "{said:?}");
    assert!(said[1].starts_with("lane.main overrun the scan took 12000 us"), "{said:?}");
}

#[test]
fn a_hundred_overruns_are_two_records() {
    let mut plant = plant();
    let mut times = vec![1; 10];
    times.extend([11; 100]);
    times.extend([1; 400]);
    scans(&mut plant, &times);
    let said: Vec<_> = records(&mut plant).into_iter().filter(|r| r.contains("overrun")).collect();
    assert_eq!(said.len(), 2, "{said:?}");
    assert!(said[1].contains("scans overran"), "{said:?}");
}

#[test]
fn the_watchdog_stops_the_lane_with_everything_safe() {
    let mut plant = plant();
    scans(&mut plant, &[1, 1]);
    assert_eq!(output(&plant), (1, Quality::Good));
    let mut lane = plant.lanes.remove(0);
    lane.scan(20 * MS, 20 * MS, || 71 * MS);
    assert_eq!(lane.state(), LaneState::Faulted);
    assert_eq!(output(&plant), (0, Quality::Bad));
    // It does not come back by itself.
    lane.scan(80 * MS, 80 * MS, || 81 * MS);
    assert_eq!(lane.statistics().scans, 3);
    let said = records(&mut plant);
    assert!(said.iter().any(|r| r.starts_with("lane.main faulted the scan took 51000 us")), "{said:?}");
}

#[test]
fn an_orderly_stop_is_told_and_final() {
    let mut plant = plant();
    scans(&mut plant, &[1, 1]);
    let mut lane = plant.lanes.remove(0);
    lane.stop(20 * MS);
    lane.stop(30 * MS);
    assert_eq!(lane.state(), LaneState::Stopped);
    lane.scan(40 * MS, 40 * MS, || 41 * MS);
    assert_eq!(lane.statistics().scans, 2);
    let said = records(&mut plant);
    assert_eq!(said.iter().filter(|r| r.contains("stopped")).count(), 1, "{said:?}");
}
