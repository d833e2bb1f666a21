//! A logger in Python: the example is built with the command of its README, and keeps 10 000 records.
#![allow(clippy::unwrap_used, reason = "a test")]

mod loggers;

use latchwork_record::rfc3339;
use loggers::{open, record, records, target};
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// The component, built by the example's own script unless that was done since its source changed.
fn built() -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/loggers/python");
    let component = target().join("test-python").join("logger.wasm");
    std::fs::create_dir_all(component.parent().unwrap()).unwrap();
    // The tests of this file want the same at the same time.
    let lock = std::fs::File::create(component.with_extension("lock")).unwrap();
    lock.lock().unwrap();
    let time = |path: &Path| std::fs::metadata(path).and_then(|m| m.modified()).ok();
    let wit = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../wit/journal");
    let sources = ["logger.py", "build.sh"].map(|f| folder.join(f));
    let sources = sources.into_iter().chain(["types.wit", "sink.wit", "logger.wit"].map(|f| wit.join(f)));
    if sources.map(|s| time(&s)).max() < Some(time(&component)) {
        return component;
    }
    let draft = component.with_extension("new");
    let mut build = Command::new(folder.join("build.sh"));
    let output = build.arg(&draft).env("LATCHWORK_COMPONENTIZE", target().join("componentize")).output().unwrap();
    let said = [output.stdout, output.stderr].map(|s| String::from_utf8_lossy(&s).into_owned()).concat();
    assert!(
        output.status.success(),
        "examples/loggers/python/build.sh failed; it needs python3 with pip and a package index:\n{said}"
    );
    std::fs::rename(&draft, &component).unwrap();
    // Compiled once for all: the first write fails without a directory, but has compiled it.
    open(folder.as_path(), &table(&component, "")).write(&records(1..=1)).unwrap_err();
    component
}

fn table(component: &Path, more: &str) -> String {
    format!("kind = 'component'\ncomponent = '{}'\nmemory = '128MiB'\nbudget = '30s'\n{more}", component.display())
}

#[test]
fn a_logger_in_python_keeps_ten_thousand_records_and_finds_its_place_again() {
    let folder = TempDir::new().unwrap();
    let component = built();
    let table = table(&component, "directory = 'logs'\nconfig = { file = 'night.txt' }");
    let mut sink = open(folder.path(), &table);
    let all = records(1..=10_000);
    for batch in all[..6000].chunks(1000) {
        assert_eq!(sink.write(batch), Ok(batch.last().unwrap().seq));
    }
    drop(sink);
    // Killed in the middle of a line, the last answer not believed.
    let file = folder.path().join("logs/night.txt");
    let size = std::fs::metadata(&file).unwrap().len();
    std::fs::OpenOptions::new().write(true).open(&file).unwrap().set_len(size - 30).unwrap();
    let mut sink = open(folder.path(), &table);
    for batch in all[5000..].chunks(1000) {
        assert_eq!(sink.write(batch), Ok(batch.last().unwrap().seq));
    }

    let text = std::fs::read_to_string(&file).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    for (line, seq) in lines.iter().zip(1..) {
        let record = record(seq);
        let time = rfc3339(record.time)[..23].replace('T', " ");
        let begin = format!("{seq} {time} {} {} {}", record.kind.name(), record.source, record.transition);
        assert!(line.starts_with(&begin), "{line}\n{begin}");
        assert!(line.ends_with(&format!("\"record {seq}, \\\"quoted\\\"\\nand a second line\"")), "{line}");
    }
    assert_eq!(lines.len(), 10_000);
    // Record 7: text, boolean. Record 128: an alarm from a real to a whole number.
    assert!(lines[6].contains(" changed -7 -> 0.5 "), "{}", lines[6]);
    assert!(lines[127].contains(" alarm zone-2.alarms.high raised 0.5 -> +on "), "{}", lines[127]);
}

#[test]
fn what_python_raises_is_told() {
    let folder = TempDir::new().unwrap();
    let component = built();
    // Raised as Err: the sentence alone.
    let told = open(folder.path(), &table(&component, "")).write(&records(1..=1)).unwrap_err();
    let sentence = "the logger does not open: /data/records.txt cannot be opened: ";
    assert!(told.starts_with(sentence) && told.contains("grant a `directory`?"), "{told}");
    // Anything else ends the instance; the end of the traceback comes with it.
    let told = open(folder.path(), &table(&component, "config = { file = 7 }")).write(&records(1..=1)).unwrap_err();
    assert!(told.contains("TypeError"), "{told}");
}
