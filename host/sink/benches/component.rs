//! Records a second into loggers that are components, on this machine's disk.
//!
//! `cargo bench --package latchwork-sink --bench component`, after `cargo xtask guests`.

use latchwork_sink::{COMPONENT, Config};
use std::time::{Duration, Instant};

#[path = "../tests/loggers/mod.rs"]
mod loggers;

const BATCHES: [u64; 4] = [1, 100, 1000, 10_000];
const LONGEST: Duration = Duration::from_secs(3);

fn main() {
    println!("{:14} {:>6}  {:>10}  {:>12}", "logger", "batch", "records/s", "per batch");
    for (name, more) in
        [("stray-logger", ""), ("csv-days", "directory = 'logs'"), ("alarm-counter", "directory = 'counts'")]
    {
        for batch in BATCHES {
            measure(name, more, batch);
        }
    }
}

fn measure(name: &str, more: &str, batch: u64) {
    let folder = tempfile::tempdir().expect("a folder");
    let config: Config = loggers::config(folder.path(), &format!("kind = 'component'\ncomponent = '{name}'\n{more}"));
    let mut sink = (COMPONENT.open)(&config).expect("a sink");
    // Compiled and opened.
    sink.write(&loggers::records(1..=1)).expect("kept");
    let batches: Vec<_> = (0..1_000_000 / batch).map(|n| (n * batch + 2)..=(n * batch + batch + 1)).collect();
    let (mut spent, mut count) = (Duration::ZERO, 0);
    for numbers in batches {
        let records = loggers::records(numbers);
        let begun = Instant::now();
        let kept = sink.write(&records).expect("kept");
        spent += begun.elapsed();
        count += 1;
        assert_eq!(Some(kept), records.last().map(|r| r.seq));
        if spent > LONGEST {
            break;
        }
    }
    let rate = (count * batch) as f64 / spent.as_secs_f64();
    println!("{name:14} {batch:>6}  {rate:>10.0}  {:>9.1} us", spent.as_secs_f64() * 1e6 / count as f64);
}
