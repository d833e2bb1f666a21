//! The journal on a real disk: values, numbers, retention, damage, a disk that is full, a process that is killed.

mod damaged;
mod disks;
mod killed;
mod retention;
mod written;

use latchwork_image::Value;
use latchwork_record::journal::{Filter, Journal, JournalError, Notice, Opening, Options, Reader};
use latchwork_record::{Kept, Kind, Record};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

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

fn open(folder: &Path) -> (Journal, Opening) {
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

fn kept(folder: &Path) -> BTreeMap<String, String> {
    match Reader::open(folder).and_then(|r| r.kept()) {
        Ok(kept) => kept,
        Err(JournalError::Missing { .. }) => BTreeMap::new(),
        Err(error) => panic!("{error}"),
    }
}

/// State that record `seq` stands for: one of a few names gets its number, or goes.
fn state_of(seq: u64) -> Vec<Kept> {
    let name = format!("alarm.{}", seq % 7);
    vec![Kept { name, value: (!seq.is_multiple_of(5)).then(|| seq.to_string()) }]
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
