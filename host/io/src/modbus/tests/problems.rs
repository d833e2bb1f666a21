//! What the checker says of wrong keys.

use super::super::{RTU, TCP};
use super::bench::{point, text, values};
use crate::driver::{DriverConfig, Problem};
use latchwork_schema::Value::{self, Duration, Integer};

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
        &[("coil", Integer(0)), ("holding-register", Integer(0))],
        &[("coil", Integer(0)), ("type", text("u16"))],
        &[("discrete-input", Integer(0)), ("bit", Integer(3)), ("words", text("little"))],
        &[("input-register", Integer(65535)), ("type", text("f32"))],
        &[("holding-register", Integer(65533)), ("type", text("f64"))],
        &[("input-register", Integer(0)), ("type", text("u16")), ("words", text("big"))],
        &[("input-register", Integer(0)), ("type", text("u16")), ("bit", Integer(3))],
        &[("coil", Integer(0)), ("real", Value::Bool(true))],
    ];
    let shown = cases.iter().map(|keys| {
        let problems = (TCP.point)(&values(keys)).expect_err("this is wrong");
        let written: Vec<String> = keys.iter().map(|(k, v)| format!("{k} = {v:?}")).collect();
        format!("{{ {} }}\n{}", written.join(", "), render(&problems))
    });
    insta::assert_snapshot!(shown.collect::<Vec<_>>().join("\n"));
}

#[test]
fn shapes() {
    for (keys, ty, writable) in [
        (&[("coil", Integer(0))][..], "bool", true),
        (&[("holding-register", Integer(0)), ("type", text("s16")), ("real", Value::Bool(true))], "f64", true),
        (&[("discrete-input", Integer(65535)), ("type", text("bool"))], "bool", false),
        (&[("input-register", Integer(65535))], "u16", false),
        (&[("holding-register", Integer(65532)), ("type", text("f64")), ("words", text("little"))], "f64", true),
        (&[("holding-register", Integer(0)), ("type", text("bool"))], "bool", true),
        (&[("holding-register", Integer(0)), ("bit", Integer(0))], "bool", false),
    ] {
        let shape = (RTU.point)(&values(keys)).unwrap();
        assert_eq!((shape.ty.to_string().as_str(), shape.writable, shape.readable), (ty, writable, true), "{keys:?}");
    }
}

fn driver(keys: &[(&str, Value)], points: Vec<crate::driver::PointConfig>) -> DriverConfig {
    DriverConfig { name: "field".into(), values: values(keys), points }
}

#[test]
fn drivers() {
    let register = |name, at, ty, safe| point(name, &[("holding-register", Integer(at)), ("type", text(ty))], safe);
    let tcp = driver(
        &[("address", text("http://plc")), ("reconnect-min", Duration(10_000_000_000))],
        vec![
            register("a", 0, "f32", Some(0)),
            register("b", 1, "u16", Some(0)),
            register("c", 1, "u16", None),
            register("d", 2, "u16", Some(0)),
            point("e", &[("discrete-input", Integer(0))], Some(0)),
            point("f", &[("input-register", Integer(0))], Some(0)),
            point("g", &[("holding-register", Integer(9)), ("bit", Integer(1))], Some(0)),
        ],
    );
    let many = (0..120).map(|n| register(["p"; 120][n as usize], n, "u16", None)).collect();
    let rtu = driver(&[("device", text("")), ("baud", Integer(2400)), ("timeout", Duration(300_000_000))], many);
    insta::assert_snapshot!(format!(
        "modbus-tcp\n{}\nmodbus-rtu\n{}",
        render(&(TCP.check)(&tcp)),
        render(&(RTU.check)(&rtu))
    ));
}

#[test]
fn what_is_right_is_not_blamed() {
    let points = || {
        vec![
            point("level", &[("input-register", Integer(0))], None),
            point("lamp", &[("coil", Integer(0))], Some(0)),
            point("lamp-read-back", &[("coil", Integer(0))], None),
            point("horn", &[("coil", Integer(1))], Some(0)),
        ]
    };
    let tcp = driver(&[("address", text("127.0.0.1:5020"))], points());
    assert_eq!((TCP.check)(&tcp), []);
    assert!((TCP.build)(tcp).is_ok());
    let rtu = driver(&[("device", text("/dev/ttyUSB0"))], points());
    assert_eq!((RTU.check)(&rtu), []);
    assert!((RTU.build)(rtu).is_ok());
}
