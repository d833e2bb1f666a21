//! What the checker says of wrong keys.

use super::super::RPPAL;
use super::super::place::Place;
use super::{driver, point, real, text, values};
use crate::driver::Problem;
use latchwork_schema::Constant;
use latchwork_schema::Value::{self, Bool, Duration, Integer};

fn render(problems: &[Problem]) -> String {
    let line = |p: &Problem| {
        let at = p.point.as_ref().map_or(String::new(), |n| format!("point `{n}`: "));
        let key = if p.key.is_empty() { String::new() } else { format!("at `{}`: ", p.key) };
        format!("  {at}{key}{}\n    help: {}", p.message, p.help.as_deref().unwrap_or("—"))
    };
    problems.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn points() {
    let cases: &[&[(&str, Value)]] = &[
        &[],
        &[("pin", Integer(17)), ("pwm", Integer(0))],
        &[("pin", Integer(17)), ("frequency", real(50.0))],
        &[("pwm", Integer(0)), ("bias", text("pull-up")), ("active-low", Bool(true)), ("frequency", real(0.5))],
        &[("pwm", Integer(0)), ("edge", text("rising")), ("debounce", Duration(1_000_000))],
        &[("pwm", Integer(0)), ("frequency", Value::Constant(Constant::Text("1kHz".into())))],
        &[("pwm", Integer(0)), ("frequency", real(f64::NAN))],
    ];
    let shown = cases.iter().map(|keys| {
        let problems = (RPPAL.point)(&values(keys)).expect_err("this is wrong");
        let written: Vec<String> = keys.iter().map(|(k, v)| format!("{k} = {v:?}")).collect();
        format!("{{ {} }}\n{}", written.join(", "), render(&problems))
    });
    insta::assert_snapshot!(shown.collect::<Vec<_>>().join("\n"));
}

#[test]
fn shapes() {
    for (keys, ty, readable) in [
        (&[("pin", Integer(0))][..], "bool", true),
        (&[("pin", Integer(27)), ("bias", text("pull-up")), ("active-low", Bool(true))], "bool", true),
        (&[("pwm", Integer(1))], "f64", false),
        (&[("pwm", Integer(1)), ("frequency", Value::Constant(Constant::Integer(50)))], "f64", false),
    ] {
        let shape = (RPPAL.point)(&values(keys)).unwrap();
        assert_eq!((shape.ty.to_string().as_str(), shape.writable, shape.readable), (ty, true, readable), "{keys:?}");
    }
}

#[test]
fn a_frequency_is_a_period_in_nanoseconds() {
    for (frequency, period) in [(1.0, 1_000_000_000), (50.0, 20_000_000), (3.0, 333_333_333), (1e7, 100)] {
        let Ok(Place::Pwm(place)) = Place::of(&values(&[("pwm", Integer(0)), ("frequency", real(frequency))])) else {
            panic!("{frequency} Hz is a frequency")
        };
        assert_eq!(place.period, period, "{frequency} Hz");
    }
}

#[test]
fn drivers() {
    let config = driver(vec![
        point("door", &[("pin", Integer(17))], None),
        point("gate", &[("pin", Integer(17))], None),
        point("trip", &[("pin", Integer(17))], Some(0)),
        point("lamp", &[("pin", Integer(5)), ("bias", text("pull-up")), ("debounce", Duration(1_000_000))], Some(0)),
        point("horn", &[("pin", Integer(6)), ("edge", text("both"))], Some(1)),
        point("fan", &[("pwm", Integer(0))], Some(0.3f64.to_bits())),
        point("pump", &[("pwm", Integer(0))], Some(1.5f64.to_bits())),
        point("valve", &[("pwm", Integer(1))], None),
    ]);
    insta::assert_snapshot!(render(&(RPPAL.check)(&config)));
}

#[test]
fn what_is_right_is_not_blamed() {
    let keys =
        [("pin", Integer(4)), ("bias", text("pull-up")), ("edge", text("falling")), ("debounce", Duration(5000))];
    let config = driver(vec![
        point("door", &keys, None),
        point("trip", &[("pin", Integer(5)), ("active-low", Bool(true))], Some(1)),
        point("fan", &[("pwm", Integer(0)), ("frequency", real(25_000.0))], Some(1.0f64.to_bits())),
        point("pump", &[("pwm", Integer(1))], Some(0)),
    ]);
    assert_eq!((RPPAL.check)(&config), []);
    assert!((RPPAL.build)(config).is_ok());
}
