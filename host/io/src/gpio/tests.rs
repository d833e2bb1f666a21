//! What can be tested without a chip; the rest runs against the kernel's own simulated chips (tests/gpio-vm).

use super::keys::GPIO;
use crate::direct::Role;
use crate::driver::{DriverConfig, DriverContext, IoEvent, Outputs, PointConfig, Problem};
use latchwork_image::{Location, Quality, Resolved, Type, View, region};
use latchwork_schema::Value::{self, Bool, Duration, Integer, Text};
use latchwork_schema::Values;
use std::sync::{Arc, Mutex};
use tokio::sync::watch;

fn values(keys: &[(&str, Value)]) -> Values {
    Values { span: 0..0, entries: keys.iter().map(|(k, v)| ((*k).to_owned(), (v.clone(), 0..0))).collect() }
}

fn text(t: &str) -> Value {
    Text(t.into())
}

fn point(name: &str, keys: &[(&str, Value)], safe: Option<u64>) -> PointConfig {
    PointConfig { name: name.into(), values: values(keys), ty: Type::Bool, safe }
}

fn config(chip: &str, points: Vec<PointConfig>) -> DriverConfig {
    DriverConfig { name: "gpio".into(), values: values(&[("chip", text(chip))]), points }
}

fn render(problems: &[Problem]) -> String {
    let line = |p: &Problem| {
        let at = p.point.as_ref().map_or(String::new(), |n| format!("point `{n}`: "));
        let key = if p.key.is_empty() { String::new() } else { format!("at `{}`: ", p.key) };
        format!("{at}{key}{}\n  help: {}", p.message, p.help.as_deref().unwrap_or("—"))
    };
    problems.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_point_is_a_bool_that_goes_both_ways() {
    for keys in [&[("line", Integer(17))][..], &[("line", text("GPIO17")), ("active-low", Bool(true))]] {
        let shape = (GPIO.point)(&values(keys)).unwrap();
        assert_eq!((shape.ty, shape.writable, shape.readable), (Type::Bool, true, true));
    }
    let wrong: Vec<_> =
        [&[][..], &[("line", text(""))]].into_iter().map(|k| (GPIO.point)(&values(k)).unwrap_err()).collect();
    insta::assert_snapshot!(wrong.iter().map(|p| render(p)).collect::<Vec<_>>().join("\n"));
}

#[test]
fn what_is_wrong_is_told_with_the_way_out() {
    let points = vec![
        point("door", &[("line", Integer(17)), ("debounce", Duration(1_000_000)), ("drive", text("open-drain"))], None),
        point("gate", &[("line", text("GPIO4")), ("initial", Bool(true))], None),
        point("trip", &[("line", Integer(27)), ("edge", text("both")), ("buffer", Integer(64))], Some(0)),
        point("door-again", &[("line", Integer(17))], None),
        point("horn", &[("line", Integer(27)), ("debounce", Duration(1_000))], Some(1)),
        point("lamp", &[("line", text("GPIO4"))], Some(0)),
    ];
    insta::assert_snapshot!(render(&(GPIO.check)(&config(" ", points))));
}

#[test]
fn what_is_right_is_not_blamed() {
    let points = vec![
        point("door", &[("line", Integer(17)), ("edge", text("both")), ("bias", text("pull-up"))], None),
        point("gate", &[("line", text("GPIO4")), ("debounce", Duration(5_000_000)), ("buffer", Integer(64))], None),
        point("trip", &[("line", Integer(27)), ("drive", text("open-drain")), ("bias", text("pull-up"))], Some(0)),
        point("horn", &[("line", Integer(22)), ("initial", Bool(false)), ("active-low", Bool(true))], Some(1)),
    ];
    let config = config("pinctrl-bcm2711", points);
    assert_eq!((GPIO.check)(&config), []);
    assert!((GPIO.build)(config.clone()).is_ok());
    let roles = vec![Role::Edge, Role::Level, Role::Output, Role::Output];
    assert!((GPIO.direct.unwrap())(config.clone(), roles).is_ok());
    assert!((GPIO.direct.unwrap())(config, vec![Role::Edge]).is_err());
}

#[test]
fn every_default_is_what_the_key_table_says() {
    let settings = super::settings::Settings::of(&values(&[("line", Integer(1))])).unwrap();
    let of = |name: &str| GPIO.point_keys.keys.iter().find(|k| k.name == name).unwrap().default;
    assert_eq!((settings.bias, of("bias")), (None, "\"as-is\""));
    assert_eq!((settings.active_low.to_string().as_str(), of("active-low")), ("false", "false"));
    assert_eq!((settings.buffer.to_string().as_str(), of("buffer")), ("1024", "1024"));
    assert_eq!((settings.edge, of("edge")), (gpiocdev::line::EdgeDetection::BothEdges, "\"both\""));
    assert_eq!((settings.drive, of("drive")), (gpiocdev::line::Drive::PushPull, "\"push-pull\""));
    assert_eq!((settings.debounce, settings.initial), (None, None));
    assert_eq!(super::keys::every(&Values::default()), std::time::Duration::from_millis(5));
}

fn told(event: &IoEvent) -> String {
    // What chips this machine has stands after the semicolon; it is another matter.
    let mut parts: Vec<&str> = event.text.split("; ").collect();
    parts.retain(|p| !p.starts_with("this machine has") && !p.starts_with("the chips here are"));
    format!("{} {} ({}): {}", event.source, event.transition, event.priority, parts.join("; "))
}

#[test]
fn a_lane_without_its_chip_says_so_once_and_goes_on_trying() {
    let mut events = Vec::new();
    for chip in ["/dev/gpiochip4711", "gpiochip4711", "no-such-label", "/dev/null"] {
        let points =
            vec![point("door", &[("line", Integer(17))], None), point("trip", &[("line", Integer(27))], Some(0))];
        let mut lane = (GPIO.direct.unwrap())(config(chip, points), vec![Role::Edge, Role::Output]).unwrap();
        let mut report = |event: IoEvent| events.push(told(&event));
        for _ in 0..3 {
            lane.open(&mut report);
            assert!(!lane.healthy() && !lane.good(0) && !lane.good(1) && lane.descriptor(0).is_none());
            assert!(!lane.edges(0, &mut |_| panic!("an edge of nothing"), &mut report));
            assert_eq!(lane.level(0, &mut report), None);
            lane.write(&[1], &mut report);
        }
    }
    insta::assert_snapshot!(events.join("\n"));
}

#[tokio::test(start_paused = true)]
async fn a_driver_without_its_chip_says_so_once_has_bad_inputs_and_tells_that_outputs_are_not_safe() {
    let points = vec![point("door", &[("line", Integer(17))], None), point("trip", &[("line", Integer(27))], Some(0))];
    let (inputs, reader) = region(&[0, Quality::Good.cell()]);
    let (_demands, demand) = region(&[1, Outputs::RUNNING]);
    let at = |slot| Resolved::Cell { location: Location { region: 0, slot, bit: None, quality: None }, not: false };
    let (stop, stopped) = watch::channel(false);
    let events = Arc::new(Mutex::new(Vec::new()));
    let kept = Arc::clone(&events);
    let context = DriverContext {
        inputs,
        outputs: Outputs::new(View::new(&[demand], &[at(0), at(1)])),
        clock: Arc::new(|| 0),
        report: Box::new(move |e| kept.lock().unwrap().push(told(&e))),
        stop: stopped,
    };
    let driver = (GPIO.build)(config("/dev/gpiochip4711", points)).unwrap();
    let task = tokio::spawn(driver.run(context));
    tokio::time::sleep(std::time::Duration::from_millis(2)).await;
    // The second publication says that the first reading was tried.
    assert_eq!((reader.publications(), Quality::from_cell(reader.cell(1))), (2, Quality::Bad));
    tokio::time::sleep(std::time::Duration::from_secs(10)).await;
    assert_eq!(reader.publications(), 2, "nothing has changed");
    stop.send_replace(true);
    task.await.unwrap();
    assert_eq!(Quality::from_cell(reader.cell(1)), Quality::Bad);
    insta::assert_snapshot!(events.lock().unwrap().join("\n"));
}
