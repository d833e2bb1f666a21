//! A process that is killed while it writes, again and again: what it called durable is there afterwards.

use latchwork_retain::{FILES, Retained, Saved, Store, Version, read};
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Tells the child where to write.
const FOLDER: &str = "LATCHWORK_RETAIN_KILLED";
const KILLS: u64 = 200;
/// For a writing to begin.
const LIMIT: Duration = Duration::from_secs(30);

/// Some blocks that all hold the same number: half of a writing would show.
fn states(number: u64) -> Retained {
    let (class, component, schema) = ("test:a/b@1.0.0".into(), "b".into(), "n:u64".into());
    let version = Arc::new(Version { class, component, hash: String::new(), schema });
    // Writing it takes long enough to be killed in the middle. Its length changes, so that old ends stand behind new ones, but
    // not always: pieces of two as long as each other make sense together, but for the checksum.
    let blocks = 1 + number / 8 * 37 % 150 * 40;
    let saved = Arc::new(Saved { version, time: number, wall: number, cells: [number].into() });
    Retained { blocks: (0..blocks).map(|n| (format!("b{n}"), Arc::clone(&saved))).collect() }
}

/// Not a test by itself: writes one number after the other and says which are durable, until it is killed.
#[test]
#[ignore = "the other test starts it"]
fn child() {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    let mut number = read(Path::new(&folder)).generation;
    loop {
        let (store, _) = Store::open(Path::new(&folder)).expect("a store");
        for _ in 0..50 {
            number += 1;
            let mut vault = store.vault();
            let writes = vault.figures().writes;
            vault.keep(Some(states(number)), true);
            while vault.figures().writes == writes {
                std::thread::yield_now();
            }
            println!("durable {number}");
            std::io::stdout().flush().expect("a reader");
        }
    }
}

#[test]
fn what_was_durable_survives_a_kill_at_any_moment() {
    let folder = TempDir::new().expect("a temporary folder");
    let mut survived = 0;
    let mut random = 0x2545_f491_4f6c_dd1d_u64;
    for kill in 0..KILLS {
        let mut child = Command::new(std::env::current_exe().expect("this program"))
            .args(["--exact", "child", "--ignored", "--nocapture"])
            .env(FOLDER, folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("a child");
        let mut lines = BufReader::new(child.stdout.take().expect("its output")).lines();
        // It has begun to write; then at a moment of its own.
        let first = lines.by_ref().map_while(Result::ok).find_map(|l| number(&l));
        let first = first.expect("it writes");
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        std::thread::sleep(Duration::from_micros(random % 20_000));
        // Now, or as soon as the next writing has begun.
        if kill % 2 == 0 {
            until_a_writing_begins(folder.path());
        }
        child.kill().expect("it is killed");
        child.wait().expect("it ends");
        let last = lines.map_while(Result::ok).filter_map(|l| number(&l)).last().unwrap_or(first);
        let found = read(folder.path());
        assert!(found.slot.is_some(), "kill {kill}: neither is whole: {:?}", found.damage);
        let now = found.retained.blocks["b0"].cells[0];
        assert_eq!(found.retained, states(now), "kill {kill}: half of a writing");
        // What was under way may have arrived whole.
        assert!(now == last || now == last + 1, "kill {kill}: {now} is there, {last} was durable");
        assert!(now > survived, "kill {kill}: it went back from {survived} to {now}");
        survived = now;
    }
    assert!(FILES.iter().all(|name| folder.path().join(name).is_file()));
}

/// Waits, for a bounded time, until the beginning of one of the files is another one: the rest of it is under way.
fn until_a_writing_begins(folder: &Path) {
    let files = FILES.map(|name| File::open(folder.join(name)).expect("a file"));
    let begins = || {
        files.each_ref().map(|file| {
            let mut bytes = [0; 64];
            file.read_at(&mut bytes, 0).expect("it is read");
            bytes
        })
    };
    let (before, end) = (begins(), Instant::now() + LIMIT);
    while begins() == before {
        assert!(Instant::now() < end, "it writes nothing any more");
        std::hint::spin_loop();
    }
}

fn number(line: &str) -> Option<u64> {
    line.split("durable ").nth(1)?.trim().parse().ok()
}
