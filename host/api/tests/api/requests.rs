//! Every route: what reaches the plant, what comes back, and what is wrong with a request.

use crate::support::{refused, rig};
use latchwork_api::Limits;
use latchwork_plant::operate::Operation;
use serde_json::{Value, json};
use std::sync::atomic::Ordering;
use std::time::Duration;

pub(crate) fn operation_of(method: &str, path: &str, body: Option<Value>) -> (Operation, String, Value) {
    let rig = rig(&[], Limits::default());
    let head = format!("{method} {path} HTTP/1.1\r\nlatchwork-origin: panel");
    let (status, answer) = rig.raw(&head, &body.map(|b| b.to_string()).unwrap_or_default());
    let mut wishes = rig.wishes();
    assert_eq!(wishes.len(), 1, "{method} {path}: {status} {answer}");
    let wish = wishes.remove(0);
    assert_eq!((wish.operator.user.as_str(), wish.operator.origin.as_str()), ("root", "panel"));
    assert_eq!(wish.forbidden, None);
    (wish.operation, wish.operator.reason, serde_json::from_str(&answer).expect("JSON"))
}

#[test]
fn each_route_brings_its_wish_with_who_from_where_and_why() {
    let text = |s: &str| s.to_owned();
    let alarm = || text("unit.alarms.high");
    let block = || text("zone-b.turbo");
    let post = |path: &str, body: Value| ("POST", path.to_owned(), Some(body));
    let get = |path: &str| ("GET", path.to_owned(), None);
    let values = vec![(text("a.settings.x"), text("1.5")), (text("a.settings.y"), text("true"))];
    for ((method, path, body), operation, why) in [
        (get("/v1/status"), Operation::Status, ""),
        (get("/v1/tags"), Operation::Read { tags: vec![text("*")] }, ""),
        (get("/v1/tags?match=a.*&match=%7Bb,c%7D"), Operation::Read { tags: vec![text("a.*"), text("{b,c}")] }, ""),
        (get("/v1/settings/zone-b.turbo"), Operation::ReadValues { block: block() }, ""),
        (
            post("/v1/settings", json!({"values": {"a.settings.x": 1.5, "a.settings.y": true}, "write": true})),
            Operation::Set { values: values.clone(), write: true },
            "",
        ),
        (
            post(
                "/v1/settings",
                json!({"values": {"a.settings.x": "1.5", "a.settings.y": "true"}, "reason": "too short"}),
            ),
            Operation::Set { values, write: false },
            "too short",
        ),
        (
            post("/v1/settings/zone-b.turbo/write", json!({"reason": "x"})),
            Operation::WriteValues { block: block() },
            "x",
        ),
        (("POST", text("/v1/settings/zone-b.turbo/discard"), None), Operation::DiscardValues { block: block() }, ""),
        (get("/v1/forces"), Operation::Forces, ""),
        (
            post("/v1/forces", json!({"tag": "field.level", "value": -3, "reason": "test"})),
            Operation::Force { tag: text("field.level"), value: text("-3") },
            "test",
        ),
        (
            ("DELETE", text("/v1/forces?tag=field.*&reason=all+done"), None),
            Operation::Unforce { tag: text("field.*") },
            "all done",
        ),
        (
            post("/v1/commands", json!({"tag": "a.commands.go"})),
            Operation::Command { tag: text("a.commands.go"), on: None },
            "",
        ),
        (
            post("/v1/commands", json!({"tag": "a.commands.go", "on": false})),
            Operation::Command { tag: text("a.commands.go"), on: Some(false) },
            "",
        ),
        (get("/v1/alarms"), Operation::Alarms { all: false }, ""),
        (get("/v1/alarms?all=true"), Operation::Alarms { all: true }, ""),
        (
            post("/v1/alarms/acknowledge", json!({"alarm": alarm(), "seen": 17})),
            Operation::Acknowledge { alarm: alarm(), seen: Some(17) },
            "",
        ),
        (
            post("/v1/alarms/shelve", json!({"alarm": alarm(), "duration": "30m", "reason": "repair"})),
            Operation::Shelve { alarm: alarm(), duration: 1_800_000_000_000 },
            "repair",
        ),
        (post("/v1/alarms/unshelve", json!({"alarm": alarm()})), Operation::Unshelve { alarm: alarm() }, ""),
        (
            post("/v1/alarms/out-of-service", json!({"alarm": alarm()})),
            Operation::OutOfService { alarm: alarm(), out: true },
            "",
        ),
        (
            post("/v1/alarms/in-service", json!({"alarm": alarm()})),
            Operation::OutOfService { alarm: alarm(), out: false },
            "",
        ),
        (post("/v1/alarms/reset", json!({"alarm": alarm()})), Operation::Reset { alarm: alarm() }, ""),
        (("POST", text("/v1/heartbeat"), None), Operation::Heartbeat, ""),
    ] {
        let (found, reason, answer) = operation_of(method, &path, body);
        assert_eq!((found, reason.as_str()), (operation, why), "{method} {path}");
        assert!(!answer.is_null(), "{method} {path}");
    }
}

#[test]
fn every_example_of_the_document_is_understood() {
    let document: Value = serde_json::from_str(latchwork_api::OPENAPI).expect("JSON");
    let mut seen = 0;
    for (path, item) in document["paths"].as_object().expect("paths") {
        for (method, operation) in item.as_object().expect("methods") {
            let example = operation.pointer("/requestBody/content/application~1json/example");
            let Some(example) = example else { continue };
            let path = path.replace("{block}", "unit").replace("{number}", "7");
            let (_, reason, _) = operation_of(&method.to_uppercase(), &path, Some(example.clone()));
            assert_eq!(reason, example["reason"].as_str().unwrap_or_default(), "{path}");
            seen += 1;
        }
    }
    assert!(seen >= 12, "only {seen} examples");
}

#[test]
fn answers_have_the_form_of_the_document() {
    let rig = rig(&[], Limits::default());
    let client = rig.client();
    let get = |path: &str| client.get::<Value>(path, &[]).expect("an answer");
    assert_eq!(get("/")["plant"], "pumps");
    assert_eq!(get("/openapi.json")["openapi"], "3.1.0");
    assert_eq!(
        get("/v1/tags")[1],
        json!({"tag": "field.lamp", "type": "bool", "value": true, "quality": "bad", "forced": true})
    );
    assert_eq!(get("/v1/forces"), json!([{"tag": "field.lamp", "value": true, "user": "alice", "since": 1}]));
    let alarm = &get("/v1/alarms")[0];
    assert_eq!((&alarm["first-out"], &alarm["shelved-until"], &alarm["seq"]), (&json!(true), &json!(0), &json!(17)));
    let schema: Value = serde_json::from_str(latchwork_api::OPENAPI).expect("JSON");
    for (name, found) in [("Tag", &get("/v1/tags")[0]), ("Force", &get("/v1/forces")[0]), ("Alarm", alarm)] {
        let described = schema["components"]["schemas"][name]["properties"].as_object().expect("properties");
        let keys: Vec<_> = found.as_object().expect("an object").keys().collect();
        assert_eq!(keys, described.keys().collect::<Vec<_>>(), "{name}");
    }
    let done: Value = client.post("/v1/heartbeat", &json!({})).expect("an answer");
    assert_eq!(done, json!({"done": ["Heartbeat"]}));
}

#[test]
fn refusals_of_the_plant_keep_their_word_and_get_their_status() {
    let rig = rig(&[], Limits::default());
    let client = rig.client();
    let set = json!({"values": {"a.settings.x": 7}});
    for (found, status, reason) in [
        (refused(client.get::<Value>("/v1/tags", &[("match", "missing")])), 404, "unknown"),
        (refused(client.post::<Value>("/v1/settings", &set)), 422, "value"),
        (refused(client.post::<Value>("/v1/alarms/reset", &json!({"alarm": "a"}))), 409, "state"),
    ] {
        assert_eq!((found.0, found.1.as_str()), (status, reason), "{}", found.2);
        assert!(found.2.len() > 10);
    }
}

#[test]
fn what_is_wrong_with_a_request_is_told_with_its_field_and_never_reaches_the_plant() {
    let rig = rig(&[], Limits::default());
    let mut all = String::new();
    let long = "x".repeat(200);
    for (head, body) in [
        ("POST /v1/commands", "{"),
        ("POST /v1/commands", "[]"),
        ("POST /v1/commands", ""),
        ("POST /v1/commands", r#"{"tag": 7}"#),
        ("POST /v1/commands", r#"{"tag": "a", "on": "yes"}"#),
        ("POST /v1/commands", r#"{"tag": "a", "onn": true}"#),
        ("POST /v1/commands", r#"{"tag": "a"} {"tag": "b"}"#),
        ("POST /v1/commands", r#"{"tag": "a", "tag": "b"}"#),
        ("POST /v1/commands", r#"{"tag": "a", "reason": "two\nlines"}"#),
        ("POST /v1/commands", &format!(r#"{{"tag": "a", "reason": "{long}"}}"#)),
        ("POST /v1/settings", r#"{"values": {}}"#),
        ("POST /v1/settings", r#"{"values": {"a.settings.x": [1]}}"#),
        ("POST /v1/settings", r#"{"values": ["a"]}"#),
        ("POST /v1/forces", r#"{"tag": "a", "value": null}"#),
        ("POST /v1/alarms/acknowledge", r#"{"alarm": "a", "seen": -1}"#),
        ("POST /v1/alarms/shelve", r#"{"alarm": "a"}"#),
        ("POST /v1/alarms/shelve", r#"{"alarm": "a", "duration": "30"}"#),
        ("POST /v1/alarms/shelve", r#"{"alarm": "a", "duration": "0s"}"#),
        ("POST /v1/alarms/shelve", r#"{"alarm": "a", "duration": "169h"}"#),
        ("GET /v1/alarms?all=perhaps", ""),
        ("GET /v1/alarms?al=true", ""),
        ("GET /v1/status?x=1", ""),
        ("GET /v1/watch?every=1ms", ""),
        ("GET /v1/watch?every=fast", ""),
        ("GET /v1/records?limit=0", ""),
        ("GET /v1/records?limit=many", ""),
        ("GET /v1/records?kind=alert", ""),
        ("GET /v1/records?source=[a", ""),
        ("GET /v1/records?from=yesterday", ""),
        ("GET /v1/nothing", ""),
        ("PUT /v1/forces", "{}"),
        ("DELETE /v1/forces", ""),
    ] {
        let (status, answer) = rig.raw(&format!("{head} HTTP/1.1"), body);
        let json: Value = serde_json::from_str(&answer).unwrap_or_else(|e| panic!("{head} {body}: {answer:?}: {e}"));
        let body = body.replace(&long, "xxx…");
        all += &format!(
            "{head} {body}\n  {status} {}: {}\n",
            json["reason"].as_str().unwrap(),
            json["message"].as_str().unwrap()
        );
    }
    insta::assert_snapshot!(all);
    let (status, answer) = rig.raw("GET /v1/status HTTP/1.1\r\nlatchwork-origin: root", "");
    assert_eq!(status, 400);
    assert!(answer.contains("expected one of api, cli, panel, script"), "{answer}");
    assert_eq!(rig.wishes(), []);
}

#[test]
fn what_is_no_http_is_closed_and_the_next_one_is_served() {
    let rig = rig(&[], Limits::default());
    for nonsense in ["\0\0\0\0", "GET\r\n\r\n", "HELLO\r\n\r\n", "{\"tag\": 1}\r\n\r\n"] {
        let (status, _) = rig.raw(nonsense, "");
        assert_eq!(status, 400, "{nonsense:?}");
    }
    assert_eq!(rig.raw("GET /v1/status HTTP/1.1", "").0, 200);
}

#[test]
fn a_plant_that_hangs_or_has_ended_is_told_in_time() {
    let limits = Limits { plant: Duration::from_millis(200), ..Limits::default() };
    let mut rig = rig(&[], limits);
    rig.plant.hangs.store(true, Ordering::Relaxed);
    let (status, reason, message) = refused(rig.client().get::<Value>("/v1/status", &[]));
    assert_eq!((status, reason.as_str()), (503, "gone"), "{message}");
    rig.plant.hangs.store(false, Ordering::Relaxed);
    rig.client().get::<Value>("/v1/status", &[]).expect("it is there again");
    rig.end_plant();
    let (status, reason, message) = refused(rig.client().get::<Value>("/v1/status", &[]));
    assert_eq!((status, reason.as_str()), (503, "gone"), "{message}");
}
