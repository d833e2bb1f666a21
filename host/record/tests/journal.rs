//! The journal on a real disk: values, numbers, damage, a disk that is full, a process that is killed.

use latchwork_image::Value;
use latchwork_record::journal::{Filter, Hole, Journal, JournalError, Notice, Options, Query, Reader, verify};
use latchwork_record::{Kept, Kind, Record};
use proptest::prelude::*;
use std::collections::BTreeMap;
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
    let start = std::time::Instant::now();
    loop {
        match Journal::open(folder, Options::default()) {
            // A process that another test starts has the lock until its program runs.
            Err(JournalError::Taken { .. }) if start.elapsed() < Duration::from_secs(5) => std::thread::yield_now(),
            opened => return opened.expect("a journal"),
        }
    }
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
fn a_damaged_file_is_set_aside_and_no_number_comes_twice() {
    let folder = TempDir::new().unwrap();
    let (mut journal, first) = open(folder.path());
    assert_eq!(first.journal.len(), 32);
    assert_ne!(first.journal, open(TempDir::new().unwrap().path()).1.journal);
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
    // Numbers go on: it is the same journal.
    assert_eq!((&opening.journal, &again.journal), (&first.journal, &first.journal));
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

/// Writes records, some at a time, and lets each lot reach the disk; what retention told meanwhile.
fn write_slowly(journal: &mut Journal, from: u64, to: u64) -> Vec<Notice> {
    let mut notices = Vec::new();
    for seq in from..=to {
        journal.push(&record(seq, &"x".repeat(400)));
        if seq % 500 == 0 {
            assert!(journal.settle(Duration::from_secs(20)));
            notices.extend(std::iter::from_fn(|| journal.notice()));
        }
    }
    notices
}

/// First number, once it stays the same for longer than retention takes to look.
fn settled_first(folder: &Path) -> u64 {
    let first = || verify(folder, |_| {}).unwrap().numbers.unwrap().0;
    let (mut now, mut since) = (first(), std::time::Instant::now());
    while since.elapsed() < Duration::from_millis(2500) {
        std::thread::sleep(Duration::from_millis(100));
        if first() != now {
            (now, since) = (first(), std::time::Instant::now());
        }
    }
    now
}

#[test]
fn what_is_too_old_goes_but_not_before_every_sink_has_it() {
    let folder = TempDir::new().unwrap();
    // A record a second: of 4000, the last 1000 and the one before are young enough.
    let options = Options { age: Some(Duration::from_secs(1000)), sinks: vec!["slow".into()], ..Options::default() };
    let (mut journal, _) = Journal::open(folder.path(), options).unwrap();
    journal.watch().moved("slow", 1234);
    journal.watch().moved("removed from the plant", 1);
    write_slowly(&mut journal, 1, 4000);
    assert_eq!(settled_first(folder.path()), 1235);
    journal.watch().moved("slow", 4000);
    assert_eq!(settled_first(folder.path()), 3000);
    assert_eq!(journal.notice(), None, "nothing was lost");
    journal.close();
    assert!(verify(folder.path(), |_| {}).unwrap().is_good());
    let (_, opening) = open(folder.path());
    assert_eq!(opening.last, 4000);
}

#[test]
fn beyond_the_size_the_oldest_go_and_a_sink_that_lacks_them_is_told_of() {
    let folder = TempDir::new().unwrap();
    let size = 4 << 20;
    let options = Options {
        size: Some(size),
        sinks: vec!["slow".into(), "fast".into()],
        within: Duration::from_millis(1),
        ..Options::default()
    };
    let (mut journal, _) = Journal::open(folder.path(), options.clone()).unwrap();
    journal.watch().moved("slow", 3000);
    journal.watch().moved("fast", 60_000);
    let mut notices = write_slowly(&mut journal, 1, 60_000);
    let first = settled_first(folder.path());
    notices.extend(std::iter::from_fn(|| journal.notice()));
    let told = |notices: &[Notice]| {
        let of = |n: &Notice| match n {
            Notice::Dropped { sink, count } if sink == "slow" => *count,
            other => panic!("{other:?}"),
        };
        notices.iter().map(of).sum::<u64>()
    };
    assert!(first > 50_000 && first < 56_000, "the file is larger than {size} bytes: it begins at {first}");
    assert_eq!(told(&notices), first - 1 - 3000, "what went beyond its cursor");
    assert!(notices.len() < 100, "{} notices", notices.len());
    // Nothing of it has become a record: it is told again.
    journal.close();
    let (mut journal, _) = Journal::open(folder.path(), options.clone()).unwrap();
    let again = loop {
        if let Some(notice) = journal.notice() {
            break notice;
        }
        std::thread::yield_now();
    };
    assert_eq!(told(std::slice::from_ref(&again)), first - 1 - 3000);
    let tells =
        Record { kind: Kind::Lost, source: "journal".into(), transition: "retention".into(), ..record(60_001, "") };
    journal.push(&tells);
    journal.close();
    let (mut journal, _) = Journal::open(folder.path(), options).unwrap();
    assert!(journal.settle(Duration::from_secs(1)));
    journal.push(&record(60_002, ""));
    assert!(journal.settle(Duration::from_secs(10)));
    assert_eq!(journal.notice(), None, "told, and not again");
    journal.close();
    assert!(verify(folder.path(), |_| {}).unwrap().is_good(), "a journal may begin at any number");
    let used = std::fs::metadata(folder.path().join("journal.db")).unwrap().len();
    assert!(used < size * 2, "{used} bytes");
}

#[test]
fn state_comes_out_of_a_damaged_file_as_far_as_it_can_be_read() {
    let folder = TempDir::new().unwrap();
    let (mut journal, _) = open(folder.path());
    journal.watch().moved("file", 4000);
    (1..=5000).for_each(|n| journal.push_with(&record(n, "before"), state_of(n)));
    journal.close();
    let state = kept(folder.path());
    assert!(!state.is_empty());
    // The pages with the records, which come after those of the tables' roots, are overwritten.
    let path = folder.path().join("journal.db");
    let mut bytes = std::fs::read(&path).unwrap();
    let end = bytes.len();
    bytes[10 * 4096..end].fill(0x5a);
    std::fs::write(&path, bytes).unwrap();
    let (mut journal, opening) = open(folder.path());
    if opening.set_aside.is_none() {
        // Nothing that is read at the opening was hit: it is seen as soon as something is written.
        (opening.last + 1..=opening.last + 10).for_each(|n| journal.push(&record(n, "after")));
        journal.close();
    }
    assert_eq!(kept(folder.path()), state);
    let cursors = Reader::open(folder.path()).unwrap().cursors().unwrap();
    assert_eq!(cursors.get("file"), Some(&4000));
}

/// Passes a test over that this machine lacks something for; where everything must be there it fails.
fn skip(why: &str) {
    assert!(std::env::var_os("LATCHWORK_SKIP").is_none_or(|s| s != "never"), "{why}");
    eprintln!("SKIPPED: {why}");
    if let Some(list) = std::env::var_os("LATCHWORK_SKIPPED") {
        let file = std::fs::OpenOptions::new().append(true).open(list);
        let written = file.and_then(|mut f| f.write_all(format!("{why}\n").as_bytes()));
        written.expect("the list of what was passed over");
    }
}

/// A file system of 1 MiB, for as long as it lives.
struct SmallDisk(TempDir);

impl SmallDisk {
    fn mount() -> Option<Self> {
        let folder = TempDir::new().unwrap();
        let mounted = Command::new("mount").args(["-t", "tmpfs", "-o", "size=1m", "none"]).arg(folder.path()).status();
        let mounted = mounted.is_ok_and(|s| s.success()).then_some(Self(folder));
        if mounted.is_none() {
            skip("a small file system cannot be mounted here; run as root");
        }
        mounted
    }

    /// Fills what is free.
    fn fill(&self) {
        let mut ballast = std::fs::File::create(self.0.path().join("ballast")).unwrap();
        while ballast.write_all(&[0; 512]).is_ok() {}
    }

    fn again(&self, options: &str) {
        let done = Command::new("mount").args(["-o", &format!("remount,{options}")]).arg(self.0.path()).status();
        assert!(done.unwrap().success());
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("--lazy").arg(self.0.path()).status();
    }
}

#[test]
fn a_full_disk_loses_nothing_that_fits_the_queue_and_tells_of_the_rest() {
    let Some(disk) = SmallDisk::mount() else { return };
    let folder = disk.0.path();
    let ballast = folder.join("ballast");
    std::fs::write(&ballast, vec![0; 600 << 10]).unwrap();
    let options = Options { within: Duration::from_millis(5), queue: 1000, ..Options::default() };
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

/// The next thing that the journal tells.
fn next_notice(journal: &Journal) -> Notice {
    let start = std::time::Instant::now();
    loop {
        if let Some(notice) = journal.notice() {
            return notice;
        }
        assert!(start.elapsed() < Duration::from_secs(10), "nothing is told");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A journal that has records 1 to 50 with their state, and a sink that has 20.
fn begun(folder: &Path) -> (Journal, BTreeMap<String, String>) {
    let options = Options { sinks: vec!["slow".into()], within: Duration::from_millis(5), ..Options::default() };
    let (mut journal, _) = Journal::open(folder, options).unwrap();
    journal.watch().moved("slow", 20);
    (1..=50).for_each(|n| journal.push_with(&record(n, ""), state_of(n)));
    assert!(journal.settle(Duration::from_secs(10)));
    (journal, kept(folder))
}

#[test]
fn an_empty_file_in_place_of_the_one_set_aside_gets_its_state_and_no_number_comes_twice() {
    let folder = TempDir::new().unwrap();
    let (journal, state) = begun(folder.path());
    journal.close();
    let file = |name: &str| folder.path().join(name);
    std::fs::rename(file("journal.db"), file("journal.damaged-1.db")).unwrap();
    std::fs::write(file("journal.db"), "").unwrap();
    for _ in 0..2 {
        let (_, opening) = open(folder.path());
        assert!(opening.last >= 50, "{}", opening.last);
        assert_eq!((opening.kept, opening.set_aside), (state.clone(), None));
    }
}

#[test]
fn damage_that_a_reader_meets_begins_a_new_file_and_tells_what_sinks_lack() {
    let folder = TempDir::new().unwrap();
    let (mut journal, state) = begun(folder.path());
    let watch = journal.watch();
    watch.damaged(watch.files() + 1, "that was another file");
    watch.damaged(watch.files(), "a page is malformed");
    assert!(matches!(next_notice(&journal), Notice::SetAside(aside) if aside.exists()));
    assert_eq!(next_notice(&journal), Notice::Dropped { sink: "slow".into(), count: 30 });
    assert_eq!((watch.files(), kept(folder.path())), (1, state));
    journal.push(&record(51, ""));
    journal.close();
    assert_eq!(all(folder.path()).iter().map(|r| r.seq).collect::<Vec<_>>(), [51]);
    // No record has told of it yet.
    let (journal, _) = open(folder.path());
    assert_eq!(next_notice(&journal), Notice::Dropped { sink: "slow".into(), count: 30 });
}

#[test]
fn damage_on_a_full_disk_sets_one_file_aside_and_loses_nothing() {
    let Some(disk) = SmallDisk::mount() else { return };
    let folder = disk.0.path();
    let (mut journal, state) = begun(folder);
    // Whoever reads it keeps its log in being.
    let reader = Reader::open(folder).unwrap();
    assert_eq!(reader.last().unwrap(), 50);
    disk.fill();
    journal.watch().damaged(0, "a page is malformed");
    assert!(matches!(next_notice(&journal), Notice::Refused(_)));
    journal.push_with(&record(51, ""), Vec::new());
    // Some more tries.
    assert!(!journal.settle(Duration::from_secs(1)));
    assert_eq!(journal.durable(), 50);
    assert!(!folder.join("journal.damaged-2.db").exists());
    disk.again("size=64m");
    assert!(matches!(next_notice(&journal), Notice::SetAside(aside) if aside.exists()));
    assert!(journal.settle(Duration::from_secs(10)));
    assert_eq!(kept(folder), state);
    assert_eq!(all(folder).iter().map(|r| r.seq).collect::<Vec<_>>(), [51]);
}

#[test]
fn a_disk_that_takes_no_cursors_does_not_keep_a_journal_from_its_end() {
    let Some(disk) = SmallDisk::mount() else { return };
    let (journal, _) = begun(disk.0.path());
    disk.fill();
    journal.watch().moved("slow", 50);
    assert!(matches!(next_notice(&journal), Notice::Refused(_)));
    let (done, end) = std::sync::mpsc::channel();
    std::thread::spawn(move || done.send(journal.close()));
    assert_eq!(end.recv_timeout(Duration::from_secs(20)), Ok(0));
}

#[test]
fn a_journal_is_opened_on_a_disk_that_is_full_or_takes_nothing_and_written_later() {
    let Some(disk) = SmallDisk::mount() else { return };
    let folder = disk.0.path();
    let (journal, state) = begun(folder);
    journal.close();
    for (next, barrier) in [(51, ""), (52, "ro")] {
        if barrier.is_empty() {
            disk.fill()
        } else {
            disk.again(barrier)
        }
        let (mut journal, opening) = open(folder);
        assert_eq!((opening.last, &opening.kept), (next - 1, &state));
        journal.push(&record(next, ""));
        assert!(matches!(next_notice(&journal), Notice::Refused(_)));
        disk.again("rw,size=64m");
        assert_eq!(next_notice(&journal), Notice::Accepted);
        assert_eq!((journal.durable(), journal.close()), (next, 0));
    }
    assert!(verify(folder, |_| {}).unwrap().is_good());
    assert_eq!((all(folder).len(), kept(folder)), (52, state));
}

#[test]
fn a_wrong_clock_makes_no_record_old_and_no_time_is_lost() {
    let folder = TempDir::new().unwrap();
    let options = Options { age: Some(Duration::from_secs(1000)), ..Options::default() };
    let (mut journal, _) = Journal::open(folder.path(), options).unwrap();
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos() as u64;
    let year = 365 * 86_400 * 1_000_000_000;
    for (seq, time) in (1..).zip([now, now, now + 10 * year, u64::MAX, now]) {
        journal.push(&Record { time, ..record(seq, "") });
    }
    assert!(journal.settle(Duration::from_secs(10)));
    assert_eq!(settled_first(folder.path()), 1);
    assert_eq!(all(folder.path())[3].time, i64::MAX as u64 - 1);
    journal.close();
}

/// Names the folder when this program is started as the process that will be killed.
const VICTIM: &str = "LATCHWORK_JOURNAL_VICTIM";

/// State that record `seq` stands for: one of a few names gets its number, or goes.
fn state_of(seq: u64) -> Vec<Kept> {
    let name = format!("alarm.{}", seq % 7);
    vec![Kept { name, value: (!seq.is_multiple_of(5)).then(|| seq.to_string()) }]
}

/// What is kept after these records.
fn state_after(records: &[Record]) -> BTreeMap<String, String> {
    let mut state = BTreeMap::new();
    for kept in records.iter().flat_map(|r| state_of(r.seq)) {
        match kept.value {
            Some(value) => state.insert(kept.name, value),
            None => state.remove(&kept.name),
        };
    }
    state
}

fn kept(folder: &Path) -> BTreeMap<String, String> {
    match Reader::open(folder).and_then(|r| r.kept()) {
        Ok(kept) => kept,
        Err(JournalError::Missing { .. }) => BTreeMap::new(),
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn victim_of_the_kill_test() {
    let Some(folder) = std::env::var_os(VICTIM) else { return };
    let (mut journal, opening) =
        Journal::open(Path::new(&folder), Options { within: Duration::from_millis(3), ..Options::default() })
            .expect("a journal");
    let (mut told, mut out) = (0, std::io::stdout().lock());
    for seq in opening.last + 1.. {
        journal.push_with(&record(seq, &format!("{}", std::process::id())), state_of(seq));
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
        assert_eq!(kept(folder.path()), state_after(&records), "round {round}: the state is not that of the records");
        owners = records.into_iter().take(durable.max(owners.len() as u64) as usize).map(|r| r.text).collect();
    }
    assert!(owners.len() > 100, "only {} records", owners.len());
    assert!(verify(folder.path(), |_| {}).unwrap().is_good());
}
