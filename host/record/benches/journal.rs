//! The journal on this machine's disk: records a second, a burst, time until a record is durable, size.
//!
//! `cargo bench -p latchwork-record --bench journal`; the files stand in the folder for temporary files.

use latchwork_image::Value;
use latchwork_record::journal::{FILE, Filter, Journal, Options, Reader};
use latchwork_record::{Datum, Entry, Kind, Record, Router, SourceId, queue};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const MANY: u64 = 1_000_000;
const BURST: u64 = 100_000;

fn record(seq: u64) -> Record {
    Record {
        seq,
        time: 1_800_000_000_000_000_000 + seq * 10_000,
        kind: Kind::Event,
        source: format!("zone-{}.pump.outputs.status", seq % 50),
        transition: "changed".into(),
        previous: Value::Integer((seq % 4096).into()),
        current: Value::Integer((seq % 4096 + 1).into()),
        priority: 0,
        user: String::new(),
        text: "+on -interlocked".into(),
    }
}

fn until_durable(journal: &Journal, seq: u64) {
    while journal.durable() < seq {
        std::thread::sleep(Duration::from_micros(200));
    }
}

/// What a record costs the lane that makes it: into a queue that somebody empties, without and with a text.
fn lane() {
    const TURNS: u64 = 2_000;
    let (mut recorder, incoming) = queue(1024, SourceId(0));
    let mut router: Router = Router::new(vec!["lane.main".into()]);
    router.add(incoming);
    let (mut plain, mut spoken) = (Duration::ZERO, Duration::ZERO);
    for turn in 0..TURNS {
        let start = Instant::now();
        for n in 0..500 {
            let entry = Entry::new(turn * 500 + n, Kind::Event, SourceId(0), "changed");
            recorder.push(std::hint::black_box(entry.change(Datum::Boolean(false), Datum::Boolean(true))));
        }
        plain += start.elapsed();
        router.release(u64::MAX, |record| {
            std::hint::black_box(record);
        });
        let start = Instant::now();
        for n in 0..500 {
            let entry = Entry::new(turn * 500 + n, Kind::Event, SourceId(0), "changed");
            recorder.push(std::hint::black_box(entry.text(format_args!("+on -interlocked {n}"))));
        }
        spoken += start.elapsed();
        router.release(u64::MAX, |record| {
            std::hint::black_box(record);
        });
    }
    let each = |time: Duration| time.as_secs_f64() * 1e9 / (TURNS * 500) as f64;
    println!("cost on the lane: {:.0} ns a record, {:.0} ns with a text", each(plain), each(spoken));
}

fn main() {
    lane();
    let folder = TempDir::new().expect("a folder");
    let (mut journal, _) = Journal::open(folder.path(), Options::default()).expect("a journal");

    let start = Instant::now();
    for seq in 1..=MANY {
        // As a plant that makes as many as the disk takes.
        while seq % 1000 == 0 && seq - journal.durable() > 100_000 {
            std::thread::sleep(Duration::from_micros(200));
        }
        journal.push(&record(seq));
    }
    until_durable(&journal, MANY);
    let rate = MANY as f64 / start.elapsed().as_secs_f64();

    let records: Vec<_> = (MANY + 1..=MANY + BURST).map(record).collect();
    let start = Instant::now();
    records.iter().for_each(|r| journal.push(r));
    let pushed = start.elapsed();
    until_durable(&journal, MANY + BURST);
    let burst = start.elapsed();

    let mut waits = Vec::new();
    let mut seq = MANY + BURST;
    for n in 0..100u64 {
        std::thread::sleep(Duration::from_millis(3 + n % 7));
        seq += 1;
        let start = Instant::now();
        journal.push(&record(seq));
        until_durable(&journal, seq);
        waits.push(start.elapsed());
    }
    waits.sort_unstable();
    assert_eq!(journal.close(), 0);
    let size = std::fs::metadata(folder.path().join(FILE)).expect("the journal").len();

    let start = Instant::now();
    let reader = Reader::open(folder.path()).expect("the journal");
    let (mut filter, mut read) = (Filter::default(), 0);
    loop {
        let page = reader.records(filter, 10_000).expect("records");
        let Some(last) = page.last() else { break };
        filter.after = last.seq;
        read += page.len() as u64;
    }
    let reading = start.elapsed();
    assert_eq!(read, seq, "every record is there");
    println!("sustained: {rate:.0} records/s durable");
    println!(
        "burst of {BURST}: handed over in {:.0} ms ({:.2} µs each), durable after {:.0} ms",
        pushed.as_secs_f64() * 1e3,
        pushed.as_secs_f64() * 1e6 / BURST as f64,
        burst.as_secs_f64() * 1e3
    );
    println!("one record: durable after {:.0} ms (median), {:.0} ms (longest of 100)", ms(waits[50]), ms(waits[99]));
    println!("size: {:.0} MB per million records", size as f64 / seq as f64);
    println!("reading: {:.0} records/s", read as f64 / reading.as_secs_f64());
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}
