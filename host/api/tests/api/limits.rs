//! Clients that hang, flood or never read harm nobody.

use crate::support::{LONG, answer, refused, rig};
use latchwork_api::Limits;
use latchwork_api::client::{Client, ClientError};
use serde_json::Value;
use std::io::{Read, Write};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Tries until it works.
#[track_caller]
fn served(client: &Client) {
    let end = Instant::now() + LONG;
    loop {
        match client.get::<Value>("/v1/status", &[]) {
            Ok(_) => return,
            Err(error) if Instant::now() > end => panic!("{error}"),
            Err(ClientError::Refused { reason, .. }) => assert_eq!(reason, "busy"),
            Err(ClientError::Broken { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn two_hundred_idle_connections_are_turned_away_and_time_out() {
    let rig = rig(&[], Limits { idle: Duration::from_secs(1), ..Limits::default() });
    let mut idle: Vec<_> = (0..200).map(|_| rig.connect()).collect();
    // The last one got no place and is told so.
    let (status, body) = answer(&mut idle[199]);
    assert_eq!(status, 503);
    assert!(body.contains("too many connections"), "{body}");
    // Those that got one and say nothing lose it.
    served(&rig.client());
    let mut rest = String::new();
    idle[0].read_to_string(&mut rest).expect("it is closed");
    assert_eq!(rest, "");
}

#[test]
fn a_head_that_never_ends_is_cut_off() {
    let rig = rig(&[], Limits { idle: Duration::from_millis(300), ..Limits::default() });
    let mut slow = rig.connect();
    write!(slow, "GET /v1/status HTTP/1.1\r\nhost: x\r\n").expect("it is taken");
    let mut said = String::new();
    slow.read_to_string(&mut said).expect("it is closed");
    assert!(said.is_empty() || said.starts_with("HTTP/1.1 408"), "{said}");
}

#[test]
fn a_body_that_is_huge_or_never_comes_is_refused() {
    let rig = rig(&[], Limits { idle: Duration::from_millis(500), ..Limits::default() });
    // Declared: refused before a byte of it was sent.
    let mut declared = rig.connect();
    write!(declared, "POST /v1/commands HTTP/1.1\r\nhost: x\r\ncontent-length: 10000000\r\n\r\n").expect("it is taken");
    let (status, body) = answer(&mut declared);
    assert_eq!(status, 413);
    assert!(body.contains("at most 65536 bytes"), "{body}");
    // Undeclared: refused as soon as it is too much.
    let mut chunked = rig.connect();
    write!(chunked, "POST /v1/commands HTTP/1.1\r\nhost: x\r\ntransfer-encoding: chunked\r\n\r\n")
        .expect("it is taken");
    let chunk = format!("1000\r\n{}\r\n", "x".repeat(4096));
    // The connection may be cut as soon as it was too much.
    let _ = (0..64).try_for_each(|_| chunked.write_all(chunk.as_bytes()));
    assert_eq!(answer(&mut chunked).0, 413);
    let mut missing = rig.connect();
    write!(missing, "POST /v1/commands HTTP/1.1\r\nhost: x\r\ncontent-length: 20\r\n\r\n{{\"tag\"")
        .expect("it is taken");
    assert_eq!(answer(&mut missing).0, 408);
    assert_eq!(rig.wishes(), []);
    served(&rig.client());
}

#[test]
fn a_client_that_never_reads_is_left() {
    let rig = rig(&[], Limits { unread: Duration::from_millis(500), connections: 1, ..Limits::default() });
    let mut deaf = rig.connect();
    write!(deaf, "GET /v1/watch?every=50ms&match=many.* HTTP/1.1\r\nhost: x\r\n\r\n").expect("it is taken");
    // It has the one place until the kernel's buffer is full and nobody has read for a while.
    let client = rig.client();
    assert_eq!(refused(client.get::<Value>("/v1/status", &[])).1, "busy");
    served(&client);
    let mut said = Vec::new();
    // The connection was cut in the middle of a line.
    let _ = deaf.read_to_end(&mut said);
    assert!(said.starts_with(b"HTTP/1.1 200") && !said.ends_with(b"\n\r\n0\r\n\r\n"), "{} bytes", said.len());
}

#[test]
fn a_client_that_reads_slowly_gets_what_is_true_then() {
    let rig = rig(&[], Limits::default());
    let client = rig.client();
    let mut lines = client.lines("/v1/watch", &[("every", "50ms"), ("match", "many.*")]).expect("lines");
    let mut values = Vec::new();
    for value in 1..=40 {
        rig.plant.level.store(value, Ordering::Relaxed);
        let line: Value = lines.next(LONG).expect("a line").expect("in time");
        values.push(line["value"].as_i64().expect("a number"));
        std::thread::sleep(Duration::from_millis(20));
    }
    // The plant was looked at a few times only: each look is taken before the next one is made.
    let looks = rig.wishes().len();
    assert!(looks <= 4, "{looks} looks");
    let last = (0..15_000).find_map(|_| {
        let line: Value = lines.next(LONG).expect("a line").expect("in time");
        (line["value"] == 40).then_some(line)
    });
    assert!(last.is_some(), "the last value never came; the first ones were {values:?}");
}
