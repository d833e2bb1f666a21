//! Records a second that sinks take out of a journal that is full of them: jsonl, a local mosquitto, a socket in syslog's place.
//!
//! `cargo bench -p latchwork-sink --bench sinks`; the files stand in the folder for temporary files. Without mosquitto its line
//! is left out.

#[path = "../tests/broker/mod.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod broker;
#[path = "../tests/support/mod.rs"]
mod support;

use latchwork_sink::kinds::{jsonl::JSONL, mqtt::MQTT, syslog::SYSLOG};
use latchwork_sink::{Config, SinkKind};
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::time::{Duration, Instant};
use support::{Bench, config};
use tempfile::TempDir;

/// Records of the journal.
const MANY: u64 = 500_000;
/// Records for the broker and the daemon, which are slower.
const FEWER: u64 = 100_000;

fn main() {
    let folder = TempDir::new().expect("a folder");
    let folder = folder.path();
    for (batch, what) in [("", "batches of up to 950, the default"), ("list = 10000\n", "batches of up to 9950")] {
        let keys = format!("path = \"r{}.jsonl\"\n{batch}", batch.len());
        rate(&format!("jsonl, {what}"), MANY, &JSONL, config(&JSONL, folder, &keys));
    }
    let socket = UnixDatagram::bind(folder.join("log")).expect("a socket");
    std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        while socket.recv(&mut buffer).is_ok() {}
    });
    rate("syslog", FEWER, &SYSLOG, config(&SYSLOG, folder, "path = \"log\""));
    match broker::Broker::new(folder, "") {
        Some(mut broker) => {
            broker.start();
            let keys = format!("address = \"127.0.0.1\"\nport = {}", broker.port);
            rate("mqtt, QoS 1, 10 in flight", FEWER, &MQTT, config(&MQTT, folder, &keys));
        }
        None => println!("mqtt: left out, mosquitto is missing; apt install mosquitto"),
    }
}

/// Fills a journal, and times how long the sink takes to have it.
fn rate(what: &str, count: u64, kind: &'static SinkKind, config: Config) {
    let folder = TempDir::new().expect("a folder");
    fill(folder.path(), count);
    let start = Instant::now();
    let bench = Bench::start(folder.path(), vec![(kind, config)]);
    bench.deliver(Duration::from_secs(600));
    println!("{what}: {:.0} records/s", count as f64 / start.elapsed().as_secs_f64());
    bench.stop();
}

fn fill(folder: &Path, count: u64) {
    let mut bench = Bench::start(folder, vec![]);
    bench.store(count);
    bench.stop();
}
