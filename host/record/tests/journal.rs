//! The journal on a real disk: values, numbers, damage, a disk that is full, a process that is killed.

use latchwork_image::Value;
use latchwork_record::journal::{Filter, Hole, Journal, JournalError, Notice, Options, Reader, verify};
use latchwork_record::{Kind, Record};
use proptest::prelude::*;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

fn record(seq: u64, text: &str) -> Record {
    Record {
        seq,
        time: 1_000_000_000 * seq,
        kind: Kind::Event,
        source: "unit.outputs.status".into(),
        transition: "changed".into(),
        previous: Value::Integer(seq.into()),
        current: Value::None,
        priority: 7,
        user: String::new(),
        text: text.into(),
    }
}

fn open(folder: &Path) -> (Journal, latchwork_record::journal::Opening) {
    Journal::open(folder, Options::default()).expect("a journal")
}

fn all(folder: &Path) -> Vec<Record> {
    match Reader::open(folder).and_then(|r| r.records(Filter::default(), usize::MAX)) {
        Ok(records) => records,
        Err(JournalError::Missing { .. }) => Vec::new(),
        Err(error) => panic!("{error}"),
    }
}

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
fn a_damaged_file_is_set_aside_and_no_number_comes_twice() {
    let folder = TempDir::new().unwrap();
    let (mut journal, _) = open(folder.path());
    (1..=5000).for_each(|n| journal.push(&record(n, "before")));
    journal.close();
    let path = folder.path().join("journal.db");
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[..100].fill(0x5a);
    std::fs::write(&path, bytes).unwrap();
    let (mut journal, opening) = open(folder.path());
    let aside = opening.set_aside.expect("the damaged file");
    assert!(aside.exists() && opening.last >= 5000, "{}", opening.last);
    journal.push(&record(opening.last + 1, "after"));
    journal.close();
    assert_eq!(all(folder.path()).len(), 1);
    // And once more: the first stays what it is.
    std::fs::write(&path, b"no database at all, and long enough to be looked at as one").unwrap();
    let (_, again) = open(folder.path());
    assert!(aside.exists() && again.set_aside.as_ref() != Some(&aside) && again.last > opening.last);
}

#[test]
fn missing_numbers_are_seen_and_explained_by_a_lost_record() {
    let folder = TempDir::new().unwrap();
    let (mut journal, _) = open(folder.path());
    let lost = Record {
        kind: Kind::Lost,
        source: "journal".into(),
        current: Value::Integer(4),
        ..record(3, "4 records found no room")
    };
    for r in [record(1, ""), record(2, ""), lost, record(7, ""), record(9, "")] {
        journal.push(&r);
    }
    journal.close();
    let verdict = verify(folder.path(), |_| {}).unwrap();
    let holes = [Hole { from: 4, to: 6, explained: true }, Hole { from: 8, to: 8, explained: false }];
    assert_eq!(verdict.holes, holes);
    assert!(!verdict.is_good());
}

/// A file system of 1 MiB, for as long as it lives.
struct SmallDisk(TempDir);

impl SmallDisk {
    fn mount() -> Option<Self> {
        let folder = TempDir::new().unwrap();
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", "size=1m", "none"]).arg(folder.path()).status();
        mounted.is_ok_and(|s| s.success()).then_some(Self(folder))
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("--lazy").arg(self.0.path()).status();
    }
}

#[test]
fn a_full_disk_loses_nothing_that_fits_the_queue_and_tells_of_the_rest() {
    let Some(disk) = SmallDisk::mount() else {
        eprintln!("SKIPPED: a small file system cannot be mounted here; run as root");
        return;
    };
    let folder = disk.0.path();
    let ballast = folder.join("ballast");
    std::fs::write(&ballast, vec![0; 600 << 10]).unwrap();
    let options = Options { within: Duration::from_millis(5), queue: 1000 };
    let (mut journal, _) = Journal::open(folder, options).unwrap();
    // More than the disk, the batch and the queue take.
    let long = "x".repeat(200);
    let mut seq = 0;
    let mut push = |journal: &mut Journal, n: u64| {
        for _ in 0..n {
            seq += 1;
            journal.push(&record(seq, &long));
        }
    };
    let mut refused = None;
    for _ in 0..4000 {
        push(&mut journal, 10);
        refused = refused.or_else(|| journal.notice());
        if refused.is_some() {
            break;
        }
        std::thread::sleep(Duration::from_micros(500));
    }
    assert!(matches!(&refused, Some(Notice::Refused(why)) if why.contains("full")), "{refused:?}");
    push(&mut journal, 30_000);
    let durable = journal.durable();
    std::fs::write(&ballast, "").unwrap();
    Command::new("mount").args(["-o", "remount,size=64m"]).arg(folder).status().unwrap();
    while journal.notice() != Some(Notice::Accepted) {
        std::thread::sleep(Duration::from_millis(5));
    }
    push(&mut journal, 10);
    assert_eq!(journal.close(), 0);
    let records = all(folder);
    let verdict = verify(folder, |_| {}).unwrap();
    assert!(verdict.is_good(), "{verdict:?}");
    assert_eq!(verdict.numbers.map(|n| n.0), Some(1));
    let gone: u64 = verdict.holes.iter().map(|h| h.to - h.from + 1).sum();
    assert!(gone > 0 && durable < records.len() as u64);
    // What is missing is exactly what the record in its place says, that one itself among it.
    let told: Vec<_> = records.iter().filter(|r| r.kind == Kind::Lost).collect();
    assert_eq!(told.iter().map(|r| r.current.to_string().parse::<u64>().unwrap() - 1).sum::<u64>(), gone);
    assert_eq!(records.last().map(|r| r.seq), Some(seq));
}

/// Names the folder when this program is started as the process that will be killed.
const VICTIM: &str = "LATCHWORK_JOURNAL_VICTIM";

#[test]
fn victim_of_the_kill_test() {
    let Some(folder) = std::env::var_os(VICTIM) else { return };
    let (mut journal, opening) =
        Journal::open(Path::new(&folder), Options { within: Duration::from_millis(3), ..Options::default() })
            .expect("a journal");
    let (mut told, mut out) = (0, std::io::stdout().lock());
    for seq in opening.last + 1.. {
        journal.push(&record(seq, &format!("{}", std::process::id())));
        let durable = journal.durable();
        if durable > told {
            told = durable;
            writeln!(out, "durable {durable}").expect("the test listens");
        }
        if seq % 64 == 0 {
            std::thread::sleep(Duration::from_micros(200));
        }
    }
}

#[test]
fn a_process_that_is_killed_hundreds_of_times_loses_nothing_that_was_durable() {
    let mut random = 12_345u64;
    (0..8).for_each(|_| kill_a_writer(25, &mut random));
}

/// Kills writers of one journal, one after the other.
fn kill_a_writer(times: usize, random: &mut u64) {
    let folder = TempDir::new().unwrap();
    // Who wrote each record that was reported durable.
    let mut owners: Vec<String> = Vec::new();
    for round in 0..times {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["victim_of_the_kill_test", "--exact", "--nocapture"])
            .env(VICTIM, folder.path())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        *random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        std::thread::sleep(Duration::from_millis(8 + (*random >> 40) % 40));
        child.kill().unwrap();
        child.wait().unwrap();
        let lines = out.lines().map_while(Result::ok);
        let durable = lines.filter_map(|l| l.strip_prefix("durable ")?.parse::<u64>().ok()).max().unwrap_or(0);
        let records = all(folder.path());
        assert!(records.len() as u64 >= durable, "round {round}: {durable} were durable, {} are there", records.len());
        assert!(records.iter().zip(1..).all(|(r, n)| r.seq == n), "round {round}: a number is missing");
        let same = owners.iter().zip(&records).all(|(owner, record)| *owner == record.text);
        assert!(same, "round {round}: a record has been replaced");
        owners = records.into_iter().take(durable.max(owners.len() as u64) as usize).map(|r| r.text).collect();
    }
    assert!(owners.len() > 100, "only {} records", owners.len());
    assert!(verify(folder.path(), |_| {}).unwrap().is_good());
}
