//! The loggers that come with Latchwork, and the one of the documentation: what they keep, exactly once, whatever is thrown away when.
#![allow(clippy::unwrap_used, reason = "a test")]

mod loggers;

use latchwork_record::{Record, rfc3339};
use latchwork_sink::{COMPONENT, Config, Sink};
use loggers::{open, record, records};
use serde_json::{Value, json};
use std::io::Read;
use std::net::TcpListener;
use std::path::Path;
use tempfile::TempDir;

const CSV: &str = "kind = 'component'\ncomponent = 'csv-days'\ndirectory = 'logs'";

/// All rows of all day files, in the order of the days.
fn rows(folder: &Path) -> Vec<(String, Vec<String>)> {
    let mut files: Vec<_> = std::fs::read_dir(folder.join("logs")).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    let mut rows = Vec::new();
    for file in files {
        let day = file.file_stem().unwrap().to_string_lossy().into_owned();
        let mut reader = csv::Reader::from_path(&file).unwrap();
        let expected = "seq,time,kind,source,transition,previous,current,priority,user,text";
        assert_eq!(reader.headers().unwrap().iter().collect::<Vec<_>>().join(","), expected);
        for row in reader.records() {
            rows.push((day.clone(), row.unwrap().iter().map(str::to_owned).collect()));
        }
    }
    rows
}

fn row(record: &Record) -> Vec<String> {
    let value = |value: &latchwork_image::Value| match value {
        latchwork_image::Value::None => String::new(),
        // What a spreadsheet would take for a formula begins with an apostrophe.
        latchwork_image::Value::Text(text) if text.starts_with(['=', '+', '-', '@']) => format!("'{text}"),
        value => value.to_string(),
    };
    vec![
        record.seq.to_string(),
        rfc3339(record.time),
        record.kind.name().into(),
        record.source.clone(),
        record.transition.to_string(),
        value(&record.previous),
        value(&record.current),
        record.priority.to_string(),
        record.user.clone(),
        record.text.clone(),
    ]
}

#[test]
fn csv_days_keeps_every_field_in_the_file_of_its_day() {
    let folder = TempDir::new().unwrap();
    let mut all = records(1..=9000);
    all[0].previous = latchwork_image::Value::Integer(u64::MAX.into());
    all[0].current = latchwork_image::Value::Real(f64::NAN);
    let mut sink = open(folder.path(), CSV);
    for batch in all.chunks(1000) {
        assert_eq!(sink.write(batch), Ok(batch.last().unwrap().seq));
    }
    let rows = rows(folder.path());
    assert_eq!(rows.len(), all.len());
    for ((day, found), record) in rows.iter().zip(&all) {
        assert_eq!(*found, row(record));
        assert!(rfc3339(record.time).starts_with(day.as_str()));
    }
    assert_eq!(rows[0].1[5], "18446744073709551615");
    let days: std::collections::BTreeSet<_> = rows.iter().map(|(day, _)| day.as_str()).collect();
    assert_eq!(days.into_iter().collect::<Vec<_>>(), ["2026-11-27", "2026-11-28", "2026-11-29"]);
}

/// A generator whose numbers are the same in every run.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }
}

/// Hands records over as the journal does; the sink is thrown away at random moments, with what it has answered believed or
/// forgotten, and between two lives something may happen to its files.
fn hand_over(folder: &Path, table: &str, last: u64, dice: &mut Dice, mut between: impl FnMut(&mut Dice)) {
    let mut sink: Option<Box<dyn Sink>> = None;
    let mut cursor = 0;
    let mut lives = 0;
    while cursor < last {
        let open = sink.get_or_insert_with(|| {
            lives += 1;
            open(folder, table)
        });
        let to = (cursor + 1 + dice.below(300)).min(last);
        let kept = open.write(&records(cursor + 1..=to)).unwrap();
        assert_eq!(kept, to);
        match dice.below(4) {
            // Killed before the answer was stored.
            0 => {
                sink = None;
                between(dice);
            }
            // Killed after.
            1 => {
                sink = None;
                cursor = kept;
            }
            _ => cursor = kept,
        }
    }
    assert!(lives > 10, "{lives} lives");
}

#[test]
fn csv_days_keeps_every_record_once_through_kills_and_torn_lines() {
    let folder = TempDir::new().unwrap();
    let mut dice = Dice(7);
    let mut torn = 0;
    hand_over(folder.path(), CSV, 9000, &mut dice, |dice| {
        // What was answered was not believed: it may not have reached the disk whole.
        let files = std::fs::read_dir(folder.path().join("logs")).unwrap().map(|e| e.unwrap().path());
        let Some(newest) = files.max() else { return };
        let size = std::fs::metadata(&newest).unwrap().len();
        let file = std::fs::OpenOptions::new().write(true).open(&newest).unwrap();
        file.set_len(size - dice.below(100)).unwrap();
        torn += 1;
    });
    let found: Vec<_> = rows(folder.path()).into_iter().map(|(_, row)| row).collect();
    let expected: Vec<_> = records(1..=9000).iter().map(row).collect();
    assert!(found == expected, "{} rows instead of {}", found.len(), expected.len());
    assert!(torn > 10, "{torn} torn");
}

#[test]
fn csv_days_says_what_it_lacks() {
    let folder = TempDir::new().unwrap();
    for (table, sentence) in [
        ("kind = 'component'\ncomponent = 'csv-days'", "csv-days needs a `directory` in the plant file"),
        (&*format!("{CSV}\nconfig = {{ day = true }}"), "`config` has a key `day`; csv-days takes none"),
    ] {
        let told = open(folder.path(), table).write(&records(1..=1)).unwrap_err();
        assert!(told.contains(sentence), "{told}");
    }
}

#[test]
fn csv_days_survives_that_its_directory_is_gone() {
    let folder = TempDir::new().unwrap();
    let mut sink = open(folder.path(), CSV);
    assert_eq!(sink.write(&records(1..=10)), Ok(10));
    drop(sink);
    std::fs::remove_dir_all(folder.path().join("logs")).unwrap();
    std::fs::write(folder.path().join("logs"), "in the way").unwrap();
    let config = loggers::config(folder.path(), CSV);
    assert_eq!((latchwork_sink::COMPONENT.check)(&config).len(), 1);
    std::fs::remove_file(folder.path().join("logs")).unwrap();
    assert_eq!(open(folder.path(), CSV).write(&records(11..=20)), Ok(20));
    assert_eq!(rows(folder.path()).len(), 10);
}

#[test]
fn numbers_of_another_journal_hide_nothing_from_the_loggers() {
    let folder = TempDir::new().unwrap();
    for (table, journal, numbers) in
        [(CSV, "one", 1..=200), (CSV, "two", 1..=130), (COUNTER, "one", 1..=200), (COUNTER, "two", 1..=130)]
    {
        let config = Config { journal: journal.into(), ..loggers::config(folder.path(), table) };
        let last = *numbers.end();
        assert_eq!((COMPONENT.open)(&config).unwrap().write(&records(numbers)), Ok(last));
    }
    std::fs::remove_file(folder.path().join("logs/journal.json")).unwrap();
    assert_eq!(rows(folder.path()).len(), 330);
    let counts = counts(folder.path());
    assert_eq!((&counts["seq"], &counts["journal"]), (&json!(128), &json!("two")));
    let raised = counts["counts"].as_object().unwrap().values().map(|c| c["raised"].as_u64().unwrap());
    assert_eq!(raised.sum::<u64>(), 5);
}

const COUNTER: &str = "kind = 'component'\ncomponent = 'alarm-counter'\ndirectory = 'counts'";

fn counts(folder: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join("counts/counts.json")).unwrap()).unwrap()
}

/// What `alarm-counter` must have counted of records 1 to `last`.
fn expected_counts(last: u64) -> Value {
    let (mut counts, mut seq) = (serde_json::Map::new(), 0);
    for record in (64..=last).step_by(64).map(record) {
        let source = counts.entry(record.source).or_insert_with(|| json!({"raised": 0}));
        source["raised"] = json!(source["raised"].as_u64().unwrap() + 1);
        seq = record.seq;
    }
    json!({"seq": seq, "counts": counts})
}

#[test]
fn alarm_counter_counts_exactly_through_kills() {
    let folder = TempDir::new().unwrap();
    hand_over(folder.path(), COUNTER, 9000, &mut Dice(3), |_| ());
    assert_eq!(counts(folder.path()), expected_counts(9000));
}

/// Takes connections until `last` has come; every line, in the order of arrival.
fn listen(listener: TcpListener, last: u64) -> std::thread::JoinHandle<Vec<Value>> {
    std::thread::spawn(move || {
        let mut lines: Vec<Value> = Vec::new();
        while lines.last().is_none_or(|l| l["seq"] != last) {
            let mut text = String::new();
            listener.accept().unwrap().0.read_to_string(&mut text).unwrap();
            lines.extend(text.lines().map(|l| serde_json::from_str(l).unwrap()));
        }
        lines
    })
}

#[test]
fn alarm_counter_forwards_alarms_alone_and_each_of_them() {
    let folder = TempDir::new().unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let table = format!("{COUNTER}\nconnect = ['{}']", listener.local_addr().unwrap());
    let last = 9000 / 64 * 64;
    let peer = listen(listener, last);
    hand_over(folder.path(), &table, 9000, &mut Dice(5), |_| ());
    let lines = peer.join().unwrap();
    let expected: Vec<Value> =
        (64..=last).step_by(64).map(|seq| serde_json::from_str(&record(seq).to_json()).unwrap()).collect();
    // What was counted already is not sent again: a batch that is offered twice was taken whole the first time.
    assert_eq!(lines, expected);
    assert_eq!(counts(folder.path()), expected_counts(9000));
}

#[test]
fn alarm_counter_counts_nothing_that_its_peer_did_not_take() {
    let folder = TempDir::new().unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let to = listener.local_addr().unwrap();
    let table = format!("{COUNTER}\nconnect = ['{to}']");
    drop(listener);
    let mut sink = open(folder.path(), &table);
    let told = sink.write(&records(1..=200)).unwrap_err();
    assert!(told.contains(&format!("{to} does not take the alarms")), "{told}");
    assert!(!folder.path().join("counts/counts.json").exists());
    let peer = listen(TcpListener::bind(to).unwrap(), 192);
    assert_eq!(sink.write(&records(1..=200)), Ok(200));
    let seqs: Vec<_> = peer.join().unwrap().iter().map(|l| l["seq"].as_u64().unwrap()).collect();
    assert_eq!(seqs, [64, 128, 192]);
    assert_eq!(counts(folder.path()), expected_counts(200));
}

#[test]
fn the_logger_of_the_documentation_is_what_is_built_and_keeps_every_record_once() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let source = std::fs::read_to_string(root.join("tests/guests/first-logger/src/lib.rs")).unwrap();
    let page = std::fs::read_to_string(root.join("docs/write-your-own-logger.md")).unwrap();
    assert!(page.contains(&format!("```rust\n{source}```")), "docs/write-your-own-logger.md differs from first-logger");

    let folder = TempDir::new().unwrap();
    let table = "kind = 'component'\ncomponent = 'first-logger'\ndirectory = 'logs'";
    let file = folder.path().join("logs/records.txt");
    hand_over(folder.path(), table, 9000, &mut Dice(11), |dice| {
        let size = std::fs::metadata(&file).unwrap().len();
        std::fs::OpenOptions::new().write(true).open(&file).unwrap().set_len(size - dice.below(60)).unwrap();
    });
    let expected: String =
        records(1..=9000).iter().map(|r| format!("{} {} {}\n", r.seq, r.source, r.transition)).collect();
    assert!(std::fs::read_to_string(&file).unwrap() == expected);
}
