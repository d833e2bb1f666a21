//! A writer that is killed loses nothing that was durable.

use super::{all, kept, record, state_of};
use latchwork_record::Record;
use latchwork_record::journal::{Journal, Options, verify};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

/// Names the folder when this program is started as the process that will be killed.
const VICTIM: &str = "LATCHWORK_JOURNAL_VICTIM";

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
            .args(["killed::victim_of_the_kill_test", "--exact", "--nocapture"])
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
