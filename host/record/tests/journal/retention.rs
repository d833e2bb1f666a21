//! What is too old or too much goes, and what sinks lack of it is told.

use super::{all, open, record};
use latchwork_record::journal::{Journal, Notice, Options, verify};
use latchwork_record::{Kind, Record};
use std::path::Path;
use std::time::Duration;
use tempfile::TempDir;

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
