//! Records over the socket, from a real journal that is being written.

use crate::support::{LONG, refused, rig};
use latchwork_api::Limits;
use latchwork_image::Value as Datum;
use latchwork_record::journal::{Journal, Options};
use latchwork_record::{Kind, Record};
use serde_json::Value;
use std::path::Path;
use std::time::{Duration, Instant};

fn record(seq: u64) -> Record {
    Record {
        seq,
        time: 1_000_000_000 * seq,
        kind: if seq.is_multiple_of(10) { Kind::Command } else { Kind::Event },
        source: format!("block-{}.outputs.status", seq % 3),
        transition: "changed".into(),
        previous: Datum::None,
        current: Datum::Integer(seq.into()),
        priority: 0,
        user: "alice".into(),
        text: String::new(),
    }
}

fn journal(folder: &Path, numbers: std::ops::RangeInclusive<u64>) -> Journal {
    let options = Options { within: Duration::from_millis(5), ..Options::default() };
    let (mut journal, _) = Journal::open(folder, options).expect("a journal");
    write(&mut journal, numbers);
    journal
}

fn write(journal: &mut Journal, numbers: std::ops::RangeInclusive<u64>) {
    let last = *numbers.end();
    numbers.for_each(|seq| journal.push(&record(seq)));
    let end = Instant::now() + LONG;
    while journal.durable() < last {
        assert!(Instant::now() < end, "the journal is not written");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn records_are_found_by_number_time_kind_and_source() {
    let rig = rig(&[], Limits::default());
    let client = rig.client();
    let (status, reason, message) = refused(client.get::<Value>("/v1/records", &[]));
    assert_eq!((status, reason.as_str()), (409, "state"), "{message}");
    let _journal = journal(&rig.folder.path().join("data"), 1..=9_000);
    for (query, first, last, count) in [
        (&[][..], 8_901, 9_000, 100),
        (&[("limit", "3")], 8_998, 9_000, 3),
        (&[("after", "8995")], 8_996, 9_000, 5),
        (&[("after", "0"), ("limit", "7")], 1, 7, 7),
        (&[("kind", "command"), ("limit", "10000")], 10, 9_000, 900),
        (&[("kind", "command")], 8_010, 9_000, 100),
        (&[("source", "block-1.*"), ("after", "0"), ("limit", "2")], 1, 4, 2),
        (&[("from", "1970-01-01T00:01:40Z"), ("to", "1970-01-01T00:01:50Z")], 100, 109, 10),
        (&[("to", "1970-01-01T00:00:03Z")], 1, 2, 2),
    ] {
        let found: Value = client.get("/v1/records", query).expect("records");
        let records = found["records"].as_array().expect("a list");
        let numbers: Vec<_> = records.iter().map(|r| r["seq"].as_u64().expect("a number")).collect();
        assert_eq!(numbers.len(), count, "{query:?}");
        assert_eq!((numbers[0], numbers[count - 1]), (first, last), "{query:?}");
        assert!(numbers.is_sorted(), "{query:?}");
    }
    let empty: Value = client.get("/v1/records", &[("kind", "swap"), ("after", "0")]).expect("no records");
    assert_eq!((&empty["records"], &empty["next"]), (&serde_json::json!([]), &9_000.into()));
}

#[test]
fn paging_by_next_sees_each_record_once() {
    let rig = rig(&[], Limits::default());
    let client = rig.client();
    let _journal = journal(&rig.folder.path().join("data"), 1..=1_000);
    let (mut after, mut seen) = ("0".to_owned(), Vec::new());
    loop {
        let found: Value =
            client.get("/v1/records", &[("after", &after), ("source", "block-2.*"), ("limit", "70")]).expect("records");
        let records = found["records"].as_array().expect("a list");
        if records.is_empty() {
            break;
        }
        seen.extend(records.iter().map(|r| r["seq"].as_u64().expect("a number")));
        after = found["next"].to_string();
    }
    assert_eq!(seen, (1..=1_000).filter(|n| n % 3 == 2).collect::<Vec<_>>());
}

#[test]
fn new_records_are_followed_from_now_on_or_from_a_number() {
    let rig = rig(&[], Limits::default());
    let client = rig.client();
    let mut journal = journal(&rig.folder.path().join("data"), 1..=50);
    let mut from_now = client.lines("/v1/records", &[("follow", "true")]).expect("lines");
    let mut from_40 =
        client.lines("/v1/records", &[("follow", "true"), ("after", "40"), ("kind", "command")]).expect("lines");
    write(&mut journal, 51..=60);
    let next = |lines: &mut latchwork_api::client::Lines<'_>| {
        lines.next::<Value>(LONG).expect("a line").expect("in time")["seq"].as_u64().expect("a number")
    };
    assert_eq!((51..=60).map(|_| next(&mut from_now)).collect::<Vec<_>>(), (51..=60).collect::<Vec<_>>());
    assert_eq!([next(&mut from_40), next(&mut from_40)], [50, 60]);
}
