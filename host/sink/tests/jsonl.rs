//! `jsonl`: exactly once, in order, whatever ends the process; rotation; a disk that is full.

mod support;

use latchwork_record::Record;
use latchwork_sink::kinds::jsonl::JSONL;
use latchwork_sink::{Config, Sink, What};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use support::{Bench, config, record, skip, wait_for};
use tempfile::TempDir;

const PATIENCE: Duration = Duration::from_secs(60);

fn open(folder: &Path, keys: &str) -> Box<dyn Sink> {
    (JSONL.open)(&config(&JSONL, folder, &format!("path = \"log/r.jsonl\"\n{keys}"))).expect("a sink")
}

fn records(numbers: impl IntoIterator<Item = u64>) -> Vec<Record> {
    numbers.into_iter().map(record).collect()
}

/// The files in order of their first number, without the folder.
fn files(folder: &Path) -> Vec<String> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder.join("log")).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "jsonl"));
    files.sort_by_key(|path| numbers_in(path).first().copied().unwrap_or(u64::MAX));
    files.iter().map(|p| p.file_name().unwrap().to_string_lossy().into_owned()).collect()
}

fn numbers_in(path: &Path) -> Vec<u64> {
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.is_empty() || text.ends_with('\n'), "{} ends in the middle of a line", path.display());
    text.lines().map(|l| serde_json::from_str::<serde_json::Value>(l).expect(l)["seq"].as_u64().unwrap()).collect()
}

fn numbers(folder: &Path) -> Vec<u64> {
    files(folder).iter().flat_map(|name| numbers_in(&folder.join("log").join(name))).collect()
}

#[test]
fn a_line_is_the_record_and_a_torn_one_is_cut_off() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("log/r.jsonl");
    let mut sink = open(folder.path(), "");
    assert_eq!(sink.kept(), None);
    assert_eq!(sink.write(&records([4, 7])), Ok(7));
    drop(sink);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), format!("{}\n{}\n", record(4).to_json(), record(7).to_json()));
    let mut file = std::fs::OpenOptions::new().append(true).open(&path).unwrap();
    file.write_all(b"{\"seq\":8,\"ti").unwrap();
    let mut sink = open(folder.path(), "");
    assert_eq!(sink.kept(), Some(7));
    assert_eq!(sink.write(&records([8])), Ok(8));
    assert_eq!(numbers(folder.path()), [4, 7, 8]);
}

#[test]
fn files_are_renamed_by_size_and_the_oldest_go() {
    let folder = TempDir::new().unwrap();
    let keys = "size = \"4KiB\"\nkeep = 3";
    let mut sink = open(folder.path(), keys);
    assert_eq!(sink.write(&records(1..=100)), Ok(100));
    for seq in 101..=200 {
        assert_eq!(sink.write(&records([seq])), Ok(seq));
    }
    let files = files(folder.path());
    assert_eq!(files.len(), 4, "{files:?}");
    assert!(files[..3].iter().all(|f| f.starts_with("r-2027-01-15-") && f.ends_with(".jsonl")), "{files:?}");
    let sizes: Vec<_> =
        files.iter().map(|f| std::fs::metadata(folder.path().join("log").join(f)).unwrap().len()).collect();
    assert!(sizes.iter().all(|s| *s <= 4096) && sizes[..3].iter().all(|s| *s > 3500), "{sizes:?}");
    let left = numbers(folder.path());
    assert_eq!(left, (left[0]..=200).collect::<Vec<_>>());
    // Ended just after a file was renamed: the number is in that one.
    let last = folder.path().join("log/r.jsonl");
    let renamed = folder.path().join(format!("log/r-2027-01-15-{}.jsonl", numbers_in(&last)[0]));
    std::fs::rename(&last, renamed).unwrap();
    assert_eq!(open(folder.path(), keys).kept(), Some(200));
}

#[test]
fn files_are_renamed_at_midnight_by_the_records_time() {
    let folder = TempDir::new().unwrap();
    let at = |seq, time: &str| Record { time: nanoseconds(time), ..record(seq) };
    let batch = [
        at(1, "2026-11-26T23:59:59.999999999Z"),
        at(2, "2026-11-27T00:00:00Z"),
        // Late ones stay where they come.
        at(3, "2026-11-26T23:59:59Z"),
        at(4, "2026-11-27T12:00:00Z"),
        at(5, "2026-11-29T01:00:00Z"),
    ];
    assert_eq!(open(folder.path(), "day = true").write(&batch[..3]), Ok(3));
    assert_eq!(open(folder.path(), "day = true").write(&batch[3..]), Ok(5));
    assert_eq!(files(folder.path()), ["r-2026-11-26-1.jsonl", "r-2026-11-27-2.jsonl", "r.jsonl"]);
    assert_eq!(numbers(folder.path()), [1, 2, 3, 4, 5]);
}

fn nanoseconds(time: &str) -> u64 {
    let time: jiff::Timestamp = time.parse().unwrap();
    u64::try_from(time.as_nanosecond()).unwrap()
}

#[test]
fn a_file_of_a_journal_that_is_gone_hides_nothing_and_is_not_written_over() {
    let folder = TempDir::new().unwrap();
    open(folder.path(), "").write(&records(1..=50)).unwrap();
    let data = folder.path().join("data");
    let mut bench = Bench::start(&data, vec![(&JSONL, config(&JSONL, folder.path(), "path = \"log/r.jsonl\""))]);
    bench.store(20);
    bench.stop();
    let log = folder.path().join("log");
    assert_eq!(numbers_in(&log.join("r.jsonl")), (1..=20).collect::<Vec<_>>());
    assert_eq!(numbers_in(&log.join("r-2027-01-15-1.jsonl")), (1..=50).collect::<Vec<_>>());
}

#[test]
fn numbers_of_another_journal_hide_nothing() {
    let folder = TempDir::new().unwrap();
    let of = |journal: &str| {
        let config = config(&JSONL, folder.path(), "path = \"log/r.jsonl\"\nsize = \"4KiB\"\nkeep = 2");
        (JSONL.open)(&Config { journal: journal.into(), ..config }).expect("a sink")
    };
    assert_eq!(of("one").write(&records(1..=100)), Ok(100));
    assert_eq!(of("one").kept(), Some(100));
    // Twice: nothing was written between.
    assert_eq!((of("two").kept(), of("two").kept()), (None, None));
    assert_eq!(of("two").write(&records(1..=60)), Ok(60));
    assert_eq!(of("two").kept(), Some(60));
    // The files that stay are the newest, although the other journal's have higher numbers.
    assert_eq!(numbers(folder.path()).last(), Some(&60));
    assert!(numbers(folder.path()).is_sorted());
}

#[test]
fn a_clock_that_is_set_back_removes_no_newer_file() {
    let folder = TempDir::new().unwrap();
    let at = |seq: u64, day: u64| Record { time: record(seq).time - day * 86_400_000_000_000, ..record(seq) };
    let keys = "size = \"4KiB\"\nkeep = 2";
    let batch: Vec<_> = (1..=200).map(|seq| at(seq, seq / 60)).collect();
    assert_eq!(open(folder.path(), keys).write(&batch), Ok(200));
    let left = numbers(folder.path());
    assert_eq!(left, (left[0]..=200).collect::<Vec<_>>());
    // Ended just after a file was renamed.
    std::fs::remove_file(folder.path().join("log/r.jsonl")).unwrap();
    let renamed = numbers(folder.path()).last().copied();
    assert_eq!(open(folder.path(), keys).kept(), renamed);
}

#[test]
fn a_file_that_somebody_takes_away_is_begun_anew() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("log/r.jsonl");
    let mut sink = open(folder.path(), "");
    assert_eq!(sink.write(&records(1..=3)), Ok(3));
    std::fs::remove_file(&path).unwrap();
    assert_eq!(sink.write(&records(4..=6)), Ok(6));
    assert_eq!(numbers_in(&path), [4, 5, 6]);
    std::fs::rename(&path, folder.path().join("log/r.jsonl.1")).unwrap();
    assert_eq!(sink.write(&records(7..=8)), Ok(8));
    assert_eq!(numbers_in(&path), [7, 8]);
    // As `copytruncate` does it.
    std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(0).unwrap();
    assert_eq!(sink.write(&records(9..=9)), Ok(9));
    assert_eq!(numbers_in(&path), [9]);
}

#[test]
fn a_file_of_somebody_elses_is_refused_and_left_alone() {
    for text in ["a list\nmilk, bread", "milk, bread", "a list\n", "{\"set\":1"] {
        let folder = TempDir::new().unwrap();
        std::fs::create_dir(folder.path().join("log")).unwrap();
        let path = folder.path().join("log/r.jsonl");
        std::fs::write(&path, text).unwrap();
        let config = config(&JSONL, folder.path(), "path = \"log/r.jsonl\"");
        let why = (JSONL.open)(&config).err().expect(text);
        assert!(why.contains("log/r.jsonl is no record; move the file away"), "{why}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }
}

#[test]
fn a_folder_that_cannot_be_made_is_told_and_tried_again() {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("log"), "no folder").unwrap();
    let data = folder.path().join("data");
    let mut bench = Bench::start(&data, vec![(&JSONL, config(&JSONL, folder.path(), "path = \"log/r.jsonl\""))]);
    bench.store(10);
    let report = bench.reports.recv_timeout(PATIENCE).unwrap();
    assert!(matches!(&report.what, What::Refused(why) if why.contains("log/r.jsonl cannot be opened")), "{report:?}");
    std::fs::remove_file(folder.path().join("log")).unwrap();
    bench.deliver(PATIENCE);
    assert_eq!(bench.reports.recv_timeout(PATIENCE).unwrap().what, What::Accepted { waiting: 10 });
    bench.stop();
    assert_eq!(numbers(folder.path()), (1..=10).collect::<Vec<_>>());
}

/// A file system of its own, for as long as it lives.
struct SmallDisk(TempDir);

impl SmallDisk {
    fn mount(size: &str) -> Option<Self> {
        let folder = TempDir::new().unwrap();
        let options = format!("size={size}");
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &options, "none"]).arg(folder.path()).stderr(Stdio::null());
        mount.status().is_ok_and(|s| s.success()).then_some(Self(folder))
    }

    fn resize(&self, size: &str) {
        let options = format!("remount,size={size}");
        assert!(Command::new("mount").args(["-o", &options]).arg(self.0.path()).status().unwrap().success());
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("--lazy").arg(self.0.path()).status();
    }
}

#[test]
fn a_full_disk_tears_no_line_and_loses_none() {
    let Some(disk) = SmallDisk::mount("256k") else {
        return skip("a small file system cannot be mounted here; run as root");
    };
    let data = TempDir::new().unwrap();
    let sink = config(&JSONL, disk.0.path(), "path = \"log/r.jsonl\"\nsize = \"64KiB\"");
    let mut bench = Bench::start(data.path(), vec![(&JSONL, sink)]);
    bench.store(5000);
    let report = bench.reports.recv_timeout(PATIENCE).unwrap();
    assert!(matches!(&report.what, What::Refused(why) if why.contains("No space left")), "{report:?}");
    // No line is torn, also before there is room: `numbers` would say so.
    assert!(!numbers(disk.0.path()).is_empty());
    disk.resize("16m");
    bench.deliver(PATIENCE);
    bench.stop();
    assert_eq!(numbers(disk.0.path()), (1..=5000).collect::<Vec<_>>());
}

/// Names the folder when this program is started as the process that will be killed.
const VICTIM: &str = "LATCHWORK_JSONL_VICTIM";

#[test]
fn victim_of_the_kill_test() {
    let Some(folder) = std::env::var_os(VICTIM).map(PathBuf::from) else { return };
    let keys = "path = \"log/r.jsonl\"\nsize = \"16KiB\"\nbatch = 20\nwait = \"1ms\"";
    let mut bench = Bench::start(&folder.join("data"), vec![(&JSONL, config(&JSONL, &folder, keys))]);
    loop {
        bench.push(50);
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_process_that_is_killed_again_and_again_writes_each_record_exactly_once() {
    let folder = TempDir::new().unwrap();
    let mut random = 4711u64;
    for _ in 0..50 {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["victim_of_the_kill_test", "--exact", "--nocapture"])
            .env(VICTIM, folder.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        std::thread::sleep(Duration::from_millis(20 + (random >> 40) % 60));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let sink = config(&JSONL, folder.path(), "path = \"log/r.jsonl\"\nsize = \"16KiB\"");
    let bench = Bench::start(&folder.path().join("data"), vec![(&JSONL, sink)]);
    let last = bench.opening.last;
    bench.deliver(PATIENCE);
    bench.stop();
    assert!(last > 1000, "only {last} records");
    assert_eq!(numbers(folder.path()), (1..=last).collect::<Vec<_>>());
    wait_for(PATIENCE, "some files were renamed", || files(folder.path()).len() > 5);
}
