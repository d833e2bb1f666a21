//! `latchwork alarms report` over a year of ten million records: seconds, records a second, memory at its peak.
//!
//! `cargo bench -p latchwork-cli --bench report [-- RECORDS [FOLDER]]`; the journal stands in the folder for temporary files,
//! or in the named one, where it stays for the next time.

use latchwork_image::Value;
use latchwork_record::journal::{FILE, Journal, Options};
use latchwork_record::{Kind, Record};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const MANY: u64 = 10_000_000;
const YEAR: u64 = 365 * 86_400_000_000_000;
/// 2027-01-15.
const BEGIN: u64 = 1_800_000_000_000_000_000;
const ALARMS: u64 = 500;

/// Four of five records are of the lives of 500 alarms, some of which come much more often than others.
fn record(seq: u64, of: u64) -> Record {
    let time = BEGIN + (u128::from(seq) * u128::from(YEAR) / u128::from(of)) as u64;
    let random = seq.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33;
    let life = ["raised", "acknowledged", "returned", "reset"];
    let states = ["normal", "unacknowledged", "active", "awaiting-reset", "normal"];
    // Groups of five records: the life of an alarm, and one of something else.
    let (step, group) = ((seq % 5) as usize, (seq / 5).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33);
    let alarm = (group % ALARMS) * (group / ALARMS % ALARMS) / ALARMS;
    if step == 4 {
        return Record {
            seq,
            time,
            kind: Kind::Event,
            source: format!("zone-{}.pump.outputs.status", random % 50),
            transition: "changed".into(),
            previous: Value::Integer((random % 4096).into()),
            current: Value::Integer((random % 4096 + 1).into()),
            priority: 0,
            user: String::new(),
            text: "+on -interlocked".into(),
        };
    }
    Record {
        seq,
        time,
        kind: Kind::Alarm,
        source: format!("zone-{}.pump.alarms.miss-{}", alarm % 50, alarm / 50),
        transition: life[step].into(),
        previous: Value::Text(states[step].into()),
        current: Value::Text(states[step + 1].into()),
        priority: [64, 64, 64, 128, 192][(alarm % 5) as usize],
        user: if step == 1 { "alice".into() } else { String::new() },
        text: String::new(),
    }
}

fn fill(folder: &Path, many: u64) {
    let (mut journal, _) = Journal::open(folder, Options::default()).expect("a journal");
    for seq in 1..=many {
        // As a plant that makes as many as the disk takes.
        while seq % 1000 == 0 && seq - journal.durable() > 100_000 {
            std::thread::sleep(Duration::from_micros(200));
        }
        journal.push(&record(seq, many));
    }
    assert_eq!(journal.close(), 0, "every record is on the disk");
}

/// Seconds, and the most memory that the program had resident, bytes.
fn report(folder: &Path, format: &str) -> (f64, u64) {
    let start = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_latchwork"))
        .args(["alarms", "report", "--format", format])
        .arg(folder)
        .stdout(Stdio::null())
        .spawn()
        .expect("latchwork starts");
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    let ended = loop {
        if let Some(ended) = child.try_wait().expect("it is our child") {
            break ended;
        }
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:"));
        let kib = line.and_then(|l| l.split_whitespace().next()).and_then(|n| n.parse::<u64>().ok());
        peak = peak.max(kib.unwrap_or(0) * 1024);
        std::thread::sleep(Duration::from_millis(2));
    };
    assert!(ended.success());
    (start.elapsed().as_secs_f64(), peak)
}

fn main() {
    let many = std::env::args().skip(1).find_map(|a| a.parse().ok()).unwrap_or(MANY);
    let (mut temporary, named) = (None, std::env::args_os().nth(2).map(PathBuf::from));
    let named = named.filter(|folder| !folder.as_os_str().as_encoded_bytes().starts_with(b"-"));
    let folder = named.unwrap_or_else(|| temporary.insert(TempDir::new().expect("a folder")).path().into());
    if !folder.join(FILE).exists() {
        fill(&folder, many);
    }
    let size = std::fs::metadata(folder.join(FILE)).expect("the journal").len();
    println!("{many} records of a year, {:.0} MB", size as f64 / 1e6);
    for (what, format) in [("first", "table"), ("again", "table"), ("as a page", "html"), ("as JSON", "json")] {
        let (seconds, peak) = report(&folder, format);
        let rate = many as f64 / seconds / 1e6;
        println!("{what}: {seconds:.2} s, {rate:.2} million records/s, {:.1} MB resident", peak as f64 / 1e6);
    }
}
