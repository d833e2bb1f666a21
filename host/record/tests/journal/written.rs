//! What is written is read: values, numbers, state, cursors, pages.

use super::{all, open, record};
use latchwork_image::Value;
use latchwork_record::journal::{Filter, Hole, Journal, JournalError, Options, Query, Reader, verify};
use latchwork_record::{Kept, Kind, Record};
use proptest::prelude::*;
use std::time::Duration;
use tempfile::TempDir;

fn values() -> impl Strategy<Value = Value> {
    prop_oneof![
        Just(Value::None),
        any::<bool>().prop_map(Value::Boolean),
        any::<i64>().prop_map(|i| Value::Integer(i.into())),
        any::<u64>().prop_map(|u| Value::Integer(u.into())),
        any::<f64>().prop_map(Value::Real),
        Just(Value::Real(f64::NAN)),
        ".{0,20}".prop_map(Value::Text),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20, ..ProptestConfig::default() })]

    #[test]
    fn what_is_written_is_read(values in prop::collection::vec((values(), values(), "\\PC{0,40}"), 1..50)) {
        let folder = TempDir::new().unwrap();
        let (mut journal, _) = open(folder.path());
        let records: Vec<_> = values.into_iter().zip(1..).map(|((previous, current, text), seq)| {
            Record { previous, current, ..record(seq, &text) }
        }).collect();
        records.iter().for_each(|r| journal.push(r));
        prop_assert_eq!(journal.close(), 0);
        // NaN is not equal to itself, but looks like itself.
        prop_assert_eq!(format!("{:?}", all(folder.path())), format!("{records:?}"));
    }
}

#[test]
fn numbers_go_on_after_a_restart_and_pages_by_number_and_time_meet() {
    let folder = TempDir::new().unwrap();
    for start in [0, 100, 200] {
        let (mut journal, opening) = open(folder.path());
        assert_eq!((opening.last, opening.set_aside), (start, None));
        (start + 1..=start + 100).for_each(|n| journal.push(&record(n, "")));
        journal.close();
    }
    let reader = Reader::open(folder.path()).unwrap();
    let page = |filter| reader.records(filter, 10).unwrap().iter().map(|r| r.seq).collect::<Vec<_>>();
    assert_eq!(page(Filter { after: 295, ..Filter::default() }), [296, 297, 298, 299, 300]);
    let times = Filter { from: 50_000_000_000, to: 53_000_000_000, ..Filter::default() };
    assert_eq!(page(times), [50, 51, 52]);
    let verdict = verify(folder.path(), |_| {}).unwrap();
    assert!(verdict.is_good());
    assert_eq!((verdict.records, verdict.numbers), (300, Some((1, 300))));
}

#[test]
fn a_journal_has_one_writer_and_any_number_of_readers() {
    let folder = TempDir::new().unwrap();
    let (mut journal, _) = open(folder.path());
    let second = Journal::open(folder.path(), Options::default()).map(|_| ());
    assert!(matches!(second, Err(JournalError::Taken { .. })), "{second:?}");
    journal.push(&record(1, ""));
    while journal.durable() < 1 {
        std::thread::yield_now();
    }
    assert_eq!(all(folder.path()).len(), 1);
}

#[test]
fn a_folder_without_a_journal_is_told() {
    let folder = TempDir::new().unwrap();
    let error = Reader::open(folder.path()).map(|_| ()).unwrap_err().to_string();
    assert!(error.starts_with("there is no journal in ") && error.contains("--data"), "{error}");
}

#[test]
fn state_and_cursors_are_there_again_at_the_next_opening() {
    let folder = TempDir::new().unwrap();
    let (mut journal, opening) = open(folder.path());
    assert!(opening.kept.is_empty() && opening.cursors.is_empty());
    let keep = |name: &str, value: Option<&str>| Kept { name: name.into(), value: value.map(Into::into) };
    journal.push_with(&record(1, ""), vec![keep("a", Some("1")), keep("b", Some("ü \0 \n"))]);
    journal.push_with(&record(2, ""), vec![keep("a", None), keep("c", Some(""))]);
    journal.keep(vec![keep("c", Some("3"))]);
    journal.watch().moved("file", 1);
    assert!(journal.settle(Duration::from_secs(10)));
    journal.watch().moved("file", 2);
    journal.close();
    let (_, opening) = open(folder.path());
    let expected = [("b", "ü \0 \n"), ("c", "3")].map(|(n, v)| (n.to_owned(), v.to_owned()));
    assert_eq!(opening.kept, expected.into());
    assert_eq!((opening.last, opening.cursors), (2, [("file".to_owned(), 2)].into()), "also what moved last");
}

#[test]
fn cursors_alone_are_written_within_two_seconds() {
    let folder = TempDir::new().unwrap();
    let (journal, _) = open(folder.path());
    journal.watch().moved("file", 7);
    let start = std::time::Instant::now();
    while Reader::open(folder.path()).unwrap().cursors().unwrap().get("file") != Some(&7) {
        assert!(start.elapsed() < Duration::from_secs(2), "the cursor is not on the disk");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn the_newest_records_that_fit_and_pages_that_tell_how_far_they_went() {
    let folder = TempDir::new().unwrap();
    let (mut journal, _) = open(folder.path());
    for seq in 1..=1000 {
        let kind = if seq % 10 == 0 { Kind::Alarm } else { Kind::Event };
        let source = if seq % 20 == 0 { "pump.alarms.dry" } else { "tank.alarms.full" };
        journal.push(&Record { kind, source: source.into(), priority: (seq % 256) as u8, ..record(seq, "") });
    }
    journal.close();
    let reader = Reader::open(folder.path()).unwrap();
    let numbers = |records: Vec<Record>| records.iter().map(|r| r.seq).collect::<Vec<_>>();
    let newest = |query: Query<'_>, limit| numbers(reader.newest(&query, limit).unwrap());
    assert_eq!(newest(Query::default(), 3), [998, 999, 1000]);
    let alarms = Query { kinds: [Kind::Alarm].into_iter().collect(), ..Query::default() };
    assert_eq!(newest(alarms, 3), [980, 990, 1000]);
    let pump = |source: &str| source.starts_with("pump.");
    assert_eq!(newest(Query { source: Some(&pump), ..alarms }, 3), [960, 980, 1000]);
    assert_eq!(
        newest(Query { priority: 250, until: 600, ..Query::default() }, 9),
        [250, 251, 252, 253, 254, 255, 506, 507, 508, 509, 510, 511][3..]
    );
    let page = |after, limit| {
        let page = reader.page(&Query { after, until: 100, source: Some(&pump), ..alarms }, limit).unwrap();
        (numbers(page.records), page.reached)
    };
    assert_eq!(page(0, 3), (vec![20, 40, 60], 60), "the limit ended it");
    assert_eq!(page(60, 3), (vec![80, 100], 100), "all up to 100 has been looked at");
}

#[test]
fn missing_numbers_are_seen_and_explained_by_a_lost_record() {
    let folder = TempDir::new().unwrap();
    let (mut journal, _) = open(folder.path());
    let lost = |seq, transition: &'static str| Record {
        kind: Kind::Lost,
        source: "journal".into(),
        transition: transition.into(),
        current: Value::Integer(4),
        ..record(seq, "4 records found no room")
    };
    // What a sink will not get is no reason for a number to be missing.
    let (full, of_a_sink) = (lost(3, "overflow"), lost(9, "retention"));
    for r in [record(1, ""), record(2, ""), full, record(7, ""), of_a_sink, record(11, "")] {
        journal.push(&r);
    }
    journal.close();
    let verdict = verify(folder.path(), |_| {}).unwrap();
    let hole = |from, to, explained| Hole { from, to, explained };
    let holes = [hole(4, 6, true), hole(8, 8, false), hole(10, 10, false)];
    assert_eq!(verdict.holes, holes);
    assert!(!verdict.is_good());
}
