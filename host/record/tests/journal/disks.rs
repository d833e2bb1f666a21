//! Disks that are full, or that take nothing.

use super::{all, begun, kept, next_notice, open, record};
use latchwork_record::Kind;
use latchwork_record::journal::{Journal, Notice, Options, Reader, verify};
use std::io::Write;
use std::process::Command;
use std::time::Duration;
use tempfile::TempDir;

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
