//! The Modbus drivers against pymodbus as TCP server and as RTU server over a pair of pseudo-terminals.

mod support;

use latchwork_image::Quality;
use latchwork_io::driver::PointConfig;
use latchwork_schema::Value;
use serde_json::json;
use std::net::TcpListener;
use support::bench::{Bench, point, until};
use support::line::Line;
use support::peer::Peer;

/// A way to the foreign server, which can start, die and return on it.
struct Way {
    kind: &'static str,
    keys: Vec<(&'static str, Value)>,
    arguments: Vec<String>,
    line: Option<Line>,
}

fn tcp() -> Way {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    Way {
        kind: "modbus-tcp",
        keys: vec![("address", Value::Text(format!("127.0.0.1:{port}")))],
        arguments: vec!["tcp".into(), "127.0.0.1".into(), port.to_string()],
        line: None,
    }
}

fn rtu() -> Way {
    let line = Line::new();
    Way {
        kind: "modbus-rtu",
        // A pseudo-terminal has no parity to set.
        keys: vec![
            ("device", Value::Text(line.ends[0].clone())),
            ("baud", Value::Integer(115_200)),
            ("parity", Value::Text("none".into())),
            ("stop-bits", Value::Integer(1)),
        ],
        arguments: vec!["rtu".into(), line.ends[1].clone(), "115200".into()],
        line: Some(line),
    }
}

impl Way {
    fn peer(&self) -> Peer {
        Peer::start(&self.arguments)
    }

    fn driver(&self, points: Vec<PointConfig>) -> Bench {
        Bench::start(self.kind, self.keys.clone(), points)
    }
}

fn good(text: &str) -> (String, Quality) {
    (text.into(), Quality::Good)
}

/// Types and orders of words: what pymodbus encodes is read, what is written pymodbus decodes.
fn values(way: &Way) {
    let read = [
        (0, "u16", "", "65535"),
        (1, "s16", "", "-2"),
        (2, "u32", "big", "305419896"),
        (4, "s32", "", "-123456"),
        (6, "f32", "big", "-12.25"),
        (8, "f64", "", "1.1"),
        (12, "u32", "little", "305419896"),
        (14, "s32", "little", "-123456"),
        (16, "f32", "little", "-12.25"),
        (18, "f64", "little", "1.1"),
    ];
    let written = [
        (0, "u16", "", "65535", "UINT16", json!(65535)),
        (1, "s16", "", "-2", "INT16", json!(-2)),
        (2, "u32", "big", "4000000000", "UINT32", json!(4_000_000_000_u32)),
        (4, "s32", "little", "-123456", "INT32", json!(-123_456)),
        (6, "f32", "little", "-12.25", "FLOAT32", json!(-12.25)),
        (8, "f64", "big", "1.1", "FLOAT64", json!(1.1)),
        // A gap, so a request of its own.
        (20, "f64", "little", "1.1", "FLOAT64", json!(1.1)),
    ];
    let mut points: Vec<PointConfig> =
        read.iter().map(|(at, ty, order, _)| point("input-register", *at, ty, order, None)).collect();
    points.extend((0..20).map(|n| point("discrete-input", n, "", "", None)));
    points.extend(written.iter().map(|(at, ty, order, ..)| point("holding-register", *at, ty, order, Some("0"))));
    points.extend([3, 4, 5, 17].map(|n| point("coil", n, "", "", Some("false"))));
    let mut peer = way.peer();
    let mut bench = way.driver(points);
    bench.expect("connected");
    for (n, (.., value)) in read.iter().enumerate() {
        assert_eq!(bench.input(n), good(value), "{:?}", read[n]);
    }
    for n in 0..20 {
        assert_eq!(bench.input(read.len() + n), good(if n % 3 == 0 { "true" } else { "false" }), "discrete input {n}");
    }
    for (n, (.., value, _, _)) in written.iter().enumerate() {
        bench.demand(n, value);
    }
    for n in [0, 2, 3] {
        bench.demand(written.len() + n, "true");
    }
    until("the last coil is written", || peer.read("coil", 17, 1) == json!([1]));
    for (at, _, order, _, kind, value) in &written {
        let order = if *order == "little" { "little" } else { "big" };
        until("the registers are written", || peer.decode(kind, order, *at as u16) == *value);
    }
    until("the coils are written", || peer.read("coil", 0, 8) == json!([0, 0, 0, 1, 0, 1, 0, 0]));
    assert_eq!(bench.stop().len(), 0, "nothing went wrong");
    assert_eq!(peer.read("coil", 0, 32), json!(vec![0; 32]), "safe values");
    assert_eq!(peer.read("holding", 0, 32), json!(vec![0; 32]), "safe values");
}

#[test]
fn tcp_values() {
    values(&tcp());
}

#[test]
fn rtu_values() {
    values(&rtu());
}

/// Absent at start, killed without a farewell, back again: three times.
fn death_and_return(way: &Way) {
    let points = vec![point("input-register", 6, "f32", "", None), point("coil", 9, "", "", Some("false"))];
    let mut bench = way.driver(points);
    bench.demand(0, "true");
    if way.line.is_none() {
        bench.expect("lost");
    } else {
        // The port opens; only the first request shows that nobody is there.
        assert!(bench.expect("lost").text.contains("cannot be reached"));
    }
    assert_eq!(bench.input(0).1, Quality::Bad);
    for _ in 0..3 {
        let mut peer = way.peer();
        bench.expect("connected");
        assert_eq!(bench.input(0), good("-12.25"));
        until("the coil is written", || peer.read("coil", 9, 1) == json!([1]));
        peer.kill();
        bench.expect("lost");
        assert_eq!(bench.input(0), ("-12.25".into(), Quality::Bad), "the last value is kept");
    }
    let last = bench.stop();
    assert_eq!(last.iter().map(|e| e.transition).collect::<Vec<_>>(), ["unsafe"]);
}

#[test]
fn tcp_death_and_return() {
    death_and_return(&tcp());
}

#[test]
fn rtu_death_and_return() {
    death_and_return(&rtu());
}

/// Exceptions touch only the points they are about.
fn exceptions(way: &Way) {
    let points = vec![
        point("input-register", 0, "", "", None),
        point("holding-register", 60, "", "", None),
        point("holding-register", 900, "", "", None),
        point("coil", 0, "", "", Some("false")),
        point("coil", 31, "", "", Some("false")),
        point("coil", 32, "", "", Some("false")),
    ];
    let mut peer = way.peer();
    let mut bench = way.driver(points);
    for n in 0..3 {
        bench.demand(n, "true");
    }
    let refused = bench.expect("refused");
    assert_eq!(refused.source, "field.holding-register-900");
    assert!(refused.text.contains("exception 2"), "{}", refused.text);
    assert_eq!(bench.expect("refused").source, "field.coil-32");
    bench.expect("connected");
    assert_eq!((bench.input(0), bench.input(1)), (good("65535"), good("0")));
    assert_eq!(bench.input(2).1, Quality::Bad);
    until("the good coils are written", || {
        peer.read("coil", 0, 1) == json!([1]) && peer.read("coil", 31, 1) == json!([1])
    });
    peer.ask(&json!({"busy": true}));
    let refused = bench.expect("refused");
    assert_eq!(refused.source, "field.input-register-0");
    assert!(refused.text.contains("busy"), "{}", refused.text);
    until("the refused point is bad", || bench.input(0) == ("65535".into(), Quality::Bad));
    assert_eq!(bench.input(1), good("0"));
    peer.ask(&json!({"busy": false}));
    assert_eq!(bench.expect("accepted").source, "field.input-register-0");
    until("the point is good again", || bench.input(0) == good("65535"));
    let last = bench.stop();
    assert_eq!(last.iter().map(|e| e.transition).collect::<Vec<_>>(), ["unsafe"]);
    assert!(last[0].text.contains("`coil-32`") && !last[0].text.contains("coil-31"), "{}", last[0].text);
}

#[test]
fn tcp_exceptions() {
    exceptions(&tcp());
}

#[test]
fn rtu_exceptions() {
    exceptions(&rtu());
}

#[test]
fn rtu_a_cut_and_a_noisy_line() {
    let way = rtu();
    let line = way.line.as_ref().unwrap();
    let _peer = way.peer();
    let bench = way.driver(vec![point("input-register", 6, "f32", "", None)]);
    bench.expect("connected");
    for _ in 0..2 {
        line.cut(true);
        bench.expect("lost");
        assert_eq!(bench.input(0), ("-12.25".into(), Quality::Bad));
        line.cut(false);
        bench.expect("connected");
        assert_eq!(bench.input(0), good("-12.25"));
        line.disturb(&[0x55; 300]);
        bench.expect("lost");
        bench.expect("connected");
        assert_eq!(bench.input(0), good("-12.25"));
    }
    assert_eq!(bench.stop().len(), 0);
}
