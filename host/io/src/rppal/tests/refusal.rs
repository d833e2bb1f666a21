//! On a machine that is no Raspberry Pi: told once, and nothing is good.

use super::super::RPPAL;
use super::{driver, point};
use crate::direct::Role;
use crate::driver::{DriverContext, IoEvent, Outputs};
use latchwork_image::{Quality, View, region};
use latchwork_schema::Value::Integer;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// These tests say what another machine sees.
fn is_pi() -> bool {
    rppal::system::DeviceInfo::new().is_ok()
}

fn told(event: &IoEvent) -> String {
    format!("{} {} {}: {}", event.source, event.transition, event.priority, event.text)
}

#[test]
fn a_lane_is_told_once_and_has_nothing_good() {
    if is_pi() {
        return;
    }
    let config = driver(vec![
        point("door", &[("pin", Integer(17))], None),
        point("level", &[("pin", Integer(18))], None),
        point("trip", &[("pin", Integer(27))], Some(1)),
        point("fan", &[("pwm", Integer(0))], Some(0)),
    ]);
    let roles = vec![Role::Edge, Role::Level, Role::Output, Role::Output];
    let mut lane = (RPPAL.direct.unwrap())(config, roles).unwrap();
    let mut events = Vec::new();
    for _ in 0..3 {
        lane.open(&mut |e| events.push(told(&e)));
    }
    assert!(!lane.healthy());
    let mut report = |e: IoEvent| panic!("nothing more is told, but {}", told(&e));
    for n in 0..4 {
        assert!(!lane.good(n) && lane.descriptor(n).is_none() && lane.level(n, &mut report).is_none());
        assert!(!lane.edges(n, &mut |_| panic!("no edge"), &mut report));
    }
    lane.write(&[1, 0], &mut report);
    // A point that does not exist is no panic.
    assert!(!lane.good(9) && lane.descriptor(9).is_none() && lane.level(9, &mut report).is_none());
    drop(lane);
    insta::assert_snapshot!(events.join("\n"));
}

#[test]
fn an_input_cannot_be_a_pwm_channel() {
    let config = driver(vec![point("fan", &[("pwm", Integer(0))], None)]);
    let error = (RPPAL.direct.unwrap())(config, vec![Role::Level]).err();
    assert_eq!(error.as_deref(), Some("point `fan` is a PWM channel: it has no input"));
}

#[tokio::test(start_paused = true)]
async fn the_driver_is_told_once_and_its_inputs_are_bad() {
    if is_pi() {
        return;
    }
    let points = vec![point("door", &[("pin", Integer(17))], None), point("level", &[("pin", Integer(18))], None)];
    let built = (RPPAL.build)(driver(points)).unwrap();
    let (writer, reader) = region(&[0; 4]);
    let (stop, stopped) = tokio::sync::watch::channel(false);
    let events = Arc::new(Mutex::new(Vec::new()));
    let kept = Arc::clone(&events);
    let context = DriverContext {
        inputs: writer,
        outputs: Outputs::new(View::new(&[], &[])),
        clock: Arc::new(|| 0),
        report: Box::new(move |e| kept.lock().unwrap().push(told(&e))),
        stop: stopped,
    };
    let task = tokio::spawn(built.run(context));
    tokio::time::sleep(Duration::from_secs(5)).await;
    assert_eq!(reader.publications(), 2, "at the beginning, and when it was tried");
    stop.send_replace(true);
    task.await.unwrap();
    assert_eq!([reader.cell(1), reader.cell(3)], [Quality::Bad.cell(); 2]);
    assert_eq!(events.lock().unwrap().len(), 1);
}
