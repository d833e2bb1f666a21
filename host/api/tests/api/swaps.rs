//! Swaps: components arrive as they were sent, one user's at a time, and not larger than is good.

use crate::requests::operation_of;
use crate::support::{answer, refused, rig, swap};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use latchwork_api::Limits;
use latchwork_plant::operate::Operation;
use latchwork_plant::swap::{Part, SwapOrder, SwapStatus, Tolerance, WayBack};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::sync::Arc;
use std::time::Duration;

fn block(name: &str, file: &str, bytes: &[u8]) -> Value {
    json!({ "block": name, "file": file, "component": BASE64_STANDARD.encode(bytes) })
}

fn part(name: &str, file: &str, bytes: &[u8]) -> Part {
    Part { block: name.into(), file: file.into(), bytes: bytes.into(), settings: Vec::new(), expects: None }
}

#[test]
fn an_order_arrives_with_all_that_was_asked_and_what_was_not_has_its_default() {
    let bytes: Vec<u8> = (0..=255).cycle().take(100_000).collect();
    let mut one = block("unit", "tank-2.wasm", &bytes);
    one["expects"] = json!("ab12");
    one["settings"] = json!({ "pulse": "300ms", "gain": 1.5 });
    let body = json!({
        "blocks": [one, block("sink.day", "other.wasm", b"")], "shadow": 300, "tolerances": { "unit.outputs.*": 1e-6 },
        "probation": 0, "allow-lossy": true, "dry-run": true, "save": true, "reason": "new filter",
    });
    let (found, reason, _) = operation_of("POST", "/v1/swaps", Some(body));
    let settings = [("gain", "1.5"), ("pulse", "300ms")].map(|(n, v)| (n.to_owned(), v.to_owned()));
    let expected = SwapOrder {
        parts: vec![
            Part { settings: settings.into(), expects: Some("ab12".into()), ..part("unit", "tank-2.wasm", &bytes) },
            part("sink.day", "other.wasm", b""),
        ],
        shadow: 300,
        tolerances: vec![Tolerance { tag: "unit.outputs.*".into(), within: 1e-6 }],
        probation: 0,
        allow_lossy: true,
        dry_run: true,
        save: true,
    };
    assert_eq!((found, reason.as_str()), (Operation::Swap(Box::new(expected)), "new filter"));

    let (found, _, answer) = operation_of("POST", "/v1/swaps", Some(json!({ "blocks": [block("a", "b.wasm", b"x")] })));
    let expected = SwapOrder {
        parts: vec![part("a", "b.wasm", b"x")],
        shadow: 0,
        tolerances: Vec::new(),
        probation: 1000,
        allow_lossy: false,
        dry_run: false,
        save: false,
    };
    assert_eq!(found, Operation::Swap(Box::new(expected)));
    assert_eq!(serde_json::from_value::<SwapStatus>(answer).expect("a swap"), swap());

    // A sink counts batches of records, of which there may be few.
    let (found, ..) = operation_of("POST", "/v1/swaps", Some(json!({ "blocks": [block("sink.a", "b.wasm", b"x")] })));
    assert!(matches!(&found, Operation::Swap(order) if order.probation == 3), "{found:?}");
}

#[test]
fn the_same_component_for_many_blocks_is_held_once() {
    let body = json!({ "blocks": [block("a", "x.wasm", &[7; 999]), block("b", "x.wasm", &[7; 999])] });
    let (Operation::Swap(order), ..) = operation_of("POST", "/v1/swaps", Some(body)) else { panic!("a swap") };
    assert!(Arc::ptr_eq(&order.parts[0].bytes, &order.parts[1].bytes));
}

#[test]
fn swaps_are_listed_asked_for_called_off_and_rolled_back() {
    let post = |path: &str, body: Value| operation_of("POST", path, Some(body));
    assert_eq!(operation_of("GET", "/v1/swaps", None).0, Operation::Swaps { number: None });
    let (found, _, answer) = operation_of("GET", "/v1/swaps/7", None);
    assert_eq!((found, &answer["stage"]), (Operation::Swaps { number: Some(7) }, &json!("shadow")));
    assert_eq!(post("/v1/swaps/7/cancel", json!({})).0, Operation::CancelSwap { number: 7 });
    let rollback = |steps| Operation::Rollback { block: "zone-b.turbo".into(), to: WayBack::Steps(steps) };
    let (found, reason, answer) =
        post("/v1/blocks/zone-b.turbo/rollback", json!({ "steps": 2, "reason": "it chatters" }));
    assert_eq!((found, reason.as_str(), &answer["number"]), (rollback(2), "it chatters", &json!(7)));
    assert_eq!(post("/v1/blocks/zone-b.turbo/rollback", json!({})).0, rollback(1));
    let to = Operation::Rollback { block: "zone-b.turbo".into(), to: WayBack::To("3f9a".into()) };
    assert_eq!(post("/v1/blocks/zone-b.turbo/rollback", json!({ "to": "3f9a" })).0, to);
    let rig = rig(&[], Limits::default());
    let (status, reason, message) = refused(rig.client().get::<Value>("/v1/swaps/8", &[]));
    assert_eq!((status, reason.as_str()), (404, "unknown"), "{message}");
}

#[test]
fn answers_about_swaps_have_the_form_of_the_document() {
    let document: Value = serde_json::from_str(latchwork_api::OPENAPI).expect("JSON");
    let status = serde_json::to_value(swap()).expect("JSON");
    for (name, at) in [
        ("Swap", ""),
        ("Plan", "/blocks/0"),
        ("Version", "/blocks/0/old"),
        ("Shadow", "/shadow/0"),
        ("Deviation", "/shadow/0/deviations/0"),
        ("FailedRun", "/shadow/0/fault"),
    ] {
        let described = document["components"]["schemas"][name]["properties"].as_object().expect("properties");
        let found = status.pointer(at).and_then(Value::as_object).expect("an object");
        let sorted = |map: &serde_json::Map<String, Value>| {
            let mut keys: Vec<_> = map.keys().cloned().collect();
            keys.sort_unstable();
            keys
        };
        assert_eq!(sorted(found), sorted(described), "{name}");
    }
    for (name, at) in
        [("Change", "/blocks/0/ports/0"), ("Field", "/blocks/0/state/0"), ("Field", "/blocks/0/settings/0")]
    {
        let described = document["components"]["schemas"][name]["properties"].as_object().expect("properties");
        let found = status.pointer(at).and_then(Value::as_object).expect("an object");
        assert!(found.keys().all(|key| described.contains_key(key)), "{name}: {found:?}");
    }
}

#[test]
fn what_is_wrong_with_an_order_is_told_with_its_field_and_never_reaches_the_plant() {
    let rig = rig(&[], Limits::default());
    let with = |file: &str| json!({ "blocks": [block("unit", file, b"x")] });
    let and = |key: &str, value: Value| {
        let mut body = with("x.wasm");
        body[key] = value;
        body
    };
    let mut all = String::new();
    for (head, body) in [
        ("POST /v1/swaps", json!({})),
        ("POST /v1/swaps", json!({ "blocks": [] })),
        ("POST /v1/swaps", json!({ "blocks": [{ "block": "unit", "file": "x.wasm" }] })),
        ("POST /v1/swaps", json!({ "blocks": [{ "block": "unit", "file": "x.wasm", "component": "=x=" }] })),
        ("POST /v1/swaps", json!({ "blocks": [block("unit", "x.wasm", b""), block("unit", "y.wasm", b"")] })),
        ("POST /v1/swaps", json!({ "blocks": [{ "block": "unit", "file": "x.wasm", "same-as": "unit" }] })),
        ("POST /v1/swaps", json!({ "blocks": [{ "block": "a", "file": "x.wasm", "component": "", "same-as": "b" }] })),
        ("POST /v1/swaps", with("../x.wasm")),
        ("POST /v1/swaps", with(".wasm")),
        ("POST /v1/swaps", with("x.wasm\n")),
        ("POST /v1/swaps", with("tank.so")),
        ("POST /v1/swaps", and("shadow", json!(-1))),
        ("POST /v1/swaps", and("shadow", json!(1_000_000_001))),
        ("POST /v1/swaps", and("probation", json!("long"))),
        ("POST /v1/swaps", and("tolerances", json!({ "unit.outputs.level": -1 }))),
        ("POST /v1/swaps", and("dry_run", json!(true))),
        ("POST /v1/swaps", and("reason", json!("two\nlines"))),
        ("GET /v1/swaps/first", json!(null)),
        ("POST /v1/swaps/-1/cancel", json!({})),
        ("POST /v1/blocks/unit/rollback", json!({ "steps": 0 })),
        ("POST /v1/blocks/unit/rollback", json!({ "steps": 2, "to": "3f9a" })),
    ] {
        let body = if body.is_null() { String::new() } else { body.to_string() };
        let (status, answer) = rig.raw(&format!("{head} HTTP/1.1"), &body);
        let json: Value = serde_json::from_str(&answer).unwrap_or_else(|e| panic!("{head} {body}: {answer:?}: {e}"));
        let [reason, message] = ["reason", "message"].map(|k| json[k].as_str().expect("text"));
        all += &format!("{head} {body}\n  {status} {reason}: {message}\n");
    }
    insta::assert_snapshot!(all);
    assert_eq!(rig.wishes(), []);
}

#[test]
fn a_component_for_several_blocks_is_sent_once_and_counts_once() {
    let rig = rig(&[], Limits { components: 270_000, ..Limits::default() });
    let mut blocks = vec![block("a", "a.wasm", &vec![1; 100_000]), block("b", "b.wasm", &vec![2; 100_000])];
    for n in 0..9 {
        blocks.push(json!({ "block": format!("a{n}"), "file": "a.wasm", "same-as": "a" }));
    }
    // The same bytes once more count no more either.
    blocks.push(block("c", "c.wasm", &vec![2; 100_000]));
    rig.client().upload::<Value>("/v1/swaps", json!({ "blocks": blocks }).to_string().into()).expect("it fits");
    let Some(Operation::Swap(order)) = rig.wishes().pop().map(|w| w.operation) else { panic!("{:?}", rig.wishes()) };
    let bytes = |n: usize| &order.parts[n].bytes;
    assert_eq!((order.parts.len(), bytes(0).len()), (12, 100_000));
    assert!((2..11).all(|n| Arc::ptr_eq(bytes(n), bytes(0))) && Arc::ptr_eq(bytes(11), bytes(1)), "held once");
}

#[test]
fn components_that_are_too_large_are_refused_before_and_while_they_come() {
    let rig = rig(&[], Limits { components: 300_000, ..Limits::default() });
    let fits = json!({ "blocks": [block("a", "a.wasm", &vec![1; 150_000]), block("b", "b.wasm", &vec![2; 150_000])] });
    rig.client().upload::<Value>("/v1/swaps", fits.to_string().into()).expect("just as large as may be");
    let large = json!({ "blocks": [block("a", "a.wasm", &vec![1; 150_000]), block("b", "b.wasm", &vec![2; 150_001])] });
    let (status, reason, message) = refused(rig.client().upload::<Value>("/v1/swaps", large.to_string().into()));
    assert_eq!((status, reason.as_str()), (413, "large"), "{message}");
    assert!(message.contains("at most 300000 bytes together"), "{message}");
    let mut declared = rig.connect();
    write!(declared, "POST /v1/swaps HTTP/1.1\r\nhost: x\r\ncontent-length: 100000000\r\n\r\n").expect("it is taken");
    assert_eq!(answer(&mut declared).0, 413);
    let mut chunked = rig.connect();
    write!(chunked, "POST /v1/swaps HTTP/1.1\r\nhost: x\r\ntransfer-encoding: chunked\r\n\r\n").expect("it is taken");
    let chunk = format!("10000\r\n{}\r\n", "x".repeat(65_536));
    // The connection may be cut as soon as it was too much.
    let _ = (0..64).try_for_each(|_| chunked.write_all(chunk.as_bytes()));
    assert_eq!(answer(&mut chunked).0, 413);
    assert_eq!(rig.wishes().len(), 1);
}

#[test]
fn a_user_sends_one_component_at_a_time_and_one_that_breaks_off_gives_its_turn_back() {
    let rig = rig(&[], Limits { idle: Duration::from_secs(2), ..Limits::default() });
    let mut first = rig.connect();
    write!(first, "POST /v1/swaps HTTP/1.1\r\nhost: x\r\nexpect: 100-continue\r\ncontent-length: 5000\r\n\r\n")
        .expect("it is taken");
    // What the server says once it reads the body: it has the turn by then.
    let mut said = [0; 25];
    first.read_exact(&mut said).expect("an answer");
    assert_eq!(&said, b"HTTP/1.1 100 Continue\r\n\r\n");
    first.write_all(b"{\"blocks\"").expect("it is taken");
    let order = json!({ "blocks": [block("a", "a.wasm", &vec![1; 100_000])] }).to_string();
    let send = || rig.client().upload::<Value>("/v1/swaps", order.clone().into());
    let (status, reason, message) = refused(send());
    assert_eq!((status, reason.as_str()), (503, "busy"), "{message}");
    assert_eq!(answer(&mut first).0, 408);
    send().expect("the turn is free again");
}
