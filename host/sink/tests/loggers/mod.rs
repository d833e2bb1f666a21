//! What the tests of loggers share.
#![allow(dead_code, reason = "every test binary uses another part of it")]
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub, reason = "not an interface")]

use latchwork_image::Value;
use latchwork_record::{Kind, Record};
use latchwork_schema::{Checker, Section, Values};
use latchwork_sink::{COMPONENT, Config, Sink};
use std::path::{Path, PathBuf};

/// Cargo's target folder: this test was built in it.
pub fn target() -> PathBuf {
    let given = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from).filter(|p| p.is_absolute());
    given.unwrap_or_else(|| {
        let exe = std::env::current_exe().unwrap();
        // TARGET/release/deps/NAME-HASH
        exe.ancestors().nth(3).unwrap().to_owned()
    })
}

/// Keys that every sink has; the owner of the plant file knows them.
static COMMON: Section = Section {
    name: "sink",
    doc: "",
    keys: &[latchwork_schema::Key::required("kind", latchwork_schema::Kind::Text, "")],
};

/// The table of a sink as a plant file has it, read as the plant file is.
pub fn config(folder: &Path, table: &str) -> Config {
    let (parsed, errors) = latchwork_schema::check::parse(table);
    assert_eq!(errors, []);
    let mut checker = Checker::default();
    let values: Values = checker.table(&[COMPONENT.keys, &COMMON], parsed.get_ref(), 0..0);
    assert_eq!(checker.findings, [], "{table}");
    let target = target();
    let components = ["components", "test-components"].map(|f| target.join(f));
    for folder in &components {
        assert!(folder.is_dir(), "no components in {}: run `cargo xtask guests` first", folder.display());
    }
    Config {
        name: "logger".into(),
        plant: "test".into(),
        folder: folder.to_owned(),
        components: components.into(),
        cache: Some(target.join("test-cache")),
        journal: String::new(),
        values,
    }
}

pub fn open(folder: &Path, table: &str) -> Box<dyn Sink> {
    let config = config(folder, table);
    assert_eq!((COMPONENT.check)(&config), []);
    (COMPONENT.open)(&config).unwrap()
}

/// One record in 64 is an alarm; values, texts and days differ.
pub fn record(seq: u64) -> Record {
    let values = [Value::None, Value::Boolean(true), Value::Integer(-7), Value::Real(0.5), Value::Text("+on".into())];
    let of = |n: u64| values[(n % 5) as usize].clone();
    let (kind, transition) = if seq.is_multiple_of(64) { (Kind::Alarm, "raised") } else { (Kind::Event, "changed") };
    Record {
        seq,
        // A day has 4000 of them.
        time: 1_795_737_600_000_000_000 + seq * 21_600_000_000,
        kind,
        source: format!("zone-{}.alarms.high", seq % 7),
        transition: transition.into(),
        previous: of(seq),
        current: of(seq / 2),
        priority: (seq % 256) as u8,
        user: String::new(),
        text: format!("record {seq}, \"quoted\"\nand a second line"),
    }
}

pub fn records(numbers: std::ops::RangeInclusive<u64>) -> Vec<Record> {
    numbers.map(record).collect()
}
