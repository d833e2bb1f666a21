//! Values that are followed.

use crate::support::{LONG, refused, rig};
use latchwork_api::Limits;
use serde_json::Value;
use std::sync::atomic::Ordering;
use std::time::Duration;

#[test]
fn everything_comes_first_and_then_what_has_changed() {
    let mut rig = rig(&[], Limits::default());
    let client = rig.client();
    let mut lines = client.lines("/v1/watch", &[("every", "50ms")]).expect("lines");
    let mut next = || lines.next::<Value>(LONG).expect("a line").expect("in time");
    let (first, second) = (next(), next());
    assert_eq!((&first["tag"], &first["value"]), (&"unit.outputs.level".into(), &0.into()));
    assert_eq!((&second["tag"], &second["quality"]), (&"field.lamp".into(), &"bad".into()));
    assert!(first["time"].as_str().is_some_and(|t| t.ends_with('Z')), "{first}");
    for value in [5, -7] {
        rig.plant.level.store(value, Ordering::Relaxed);
        let line = next();
        assert_eq!((&line["tag"], &line["value"]), (&"unit.outputs.level".into(), &value.into()));
    }
    assert!(lines.next::<Value>(Duration::from_millis(300)).expect("still there").is_none(), "nothing has changed");
    rig.end_plant();
    let (_, reason, message) = refused(lines.next::<Value>(LONG));
    assert_eq!(reason, "gone", "{message}");
}

#[test]
fn what_cannot_be_watched_is_told_at_once() {
    let rig = rig(&[], Limits::default());
    let client = rig.client();
    let error = client.lines("/v1/watch", &[("match", "missing")]).map(|_| ());
    assert_eq!(refused(error).0, 404);
}

#[test]
fn a_watcher_that_goes_away_asks_the_plant_no_more() {
    let rig = rig(&[], Limits::default());
    let client = rig.client();
    let mut lines = client.lines("/v1/watch", &[("every", "50ms")]).expect("lines");
    lines.next::<Value>(LONG).expect("a line").expect("in time");
    drop(lines);
    drop(client);
    // One look may have begun.
    let end = std::time::Instant::now() + LONG;
    loop {
        rig.wishes();
        std::thread::sleep(Duration::from_millis(200));
        if rig.wishes().is_empty() {
            break;
        }
        assert!(std::time::Instant::now() < end, "the plant is still asked");
    }
}
