//! `latchwork alarms report`: what stands in a journal becomes the figures of ISA-18.2, in three forms.

use latchwork_image::Value;
use latchwork_record::journal::{Journal, Options};
use latchwork_record::{Kind, Record};
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

const S: u64 = 1_000_000_000;
const M: u64 = 60 * S;
const HOUR: u64 = 60 * M;
/// 2026-11-25T00:00:00Z.
const BEGIN: u64 = 1_795_564_800 * S;

fn latchwork(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.current_dir(folder).env("NO_COLOR", "1").env("COLUMNS", "100");
    command.args(args).output().expect("latchwork starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// The output of a command that succeeds.
fn said(folder: &Path, args: &[&str]) -> String {
    let output = latchwork(folder, args);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stdout)
}

/// A row of a history: when, the alarm, its transition, states before and after, priority, user.
type Row<'a> = (u64, &'a str, &'a str, &'a str, &'a str, u8, &'a str);

fn record((time, source, transition, previous, current, priority, user): Row<'_>) -> Record {
    let value = |word: &str| match word {
        "false" | "true" => Value::Boolean(word == "true"),
        word => Value::Text(word.into()),
    };
    Record {
        seq: 0,
        time: BEGIN + time,
        kind: Kind::Alarm,
        source: source.into(),
        transition: String::from(transition).into(),
        previous: value(previous),
        current: value(current),
        priority,
        user: user.into(),
        text: String::new(),
    }
}

/// The plant says that it runs, and stops.
fn lane(time: u64, transition: &'static str) -> Record {
    let row = (time, "main", transition, "", "", 0, "");
    Record { kind: Kind::Lane, previous: Value::None, current: Value::None, ..record(row) }
}

/// A folder with a journal `data` of these records in the order of time.
fn journal(mut records: Vec<Record>) -> TempDir {
    let folder = TempDir::new().expect("a folder");
    records.sort_by_key(|r| r.time);
    let (mut journal, _) = Journal::open(&folder.path().join("data"), Options::default()).expect("a journal");
    for (record, seq) in records.iter_mut().zip(1..) {
        record.seq = seq;
        journal.push(record);
    }
    assert_eq!(journal.close(), 0);
    folder
}

/// Names come from files: they may hold anything.
const STRANGE: &str = "pump.alarms.<miss>&\"starting\"\u{7}\u{1b}[31m";
/// How a page shows that.
const SHOWN: &str = "pump.alarms.<miss>&\"starting\"\u{fffd}\u{fffd}[31m";
const PUMP: &str = "pump.alarms.miss-starting";

/// Two days of a small plant: a quiet day, then a pump that chatters, a flood, and an alarm that nobody looks at.
fn two_days(pump: &str) -> Vec<Record> {
    let mut all = vec![lane(0, "started"), lane(48 * HOUR, "stopped")];
    let mut add = |row: Row<'_>| all.push(record(row));
    for hour in 0..20 {
        let at = hour * HOUR + 7 * M;
        add((at, "tank.alarms.low", "raised", "normal", "unacknowledged", 64, ""));
        add((at + (20 + hour) * S, "tank.alarms.low", "acknowledged", "unacknowledged", "active", 64, "alice"));
        add((at + 2 * M, "tank.alarms.low", "returned", "active", "normal", 64, ""));
    }
    add((3 * HOUR, "cooling.alarms.hot", "raised", "normal", "unacknowledged", 128, ""));
    for n in 0..6 {
        let at = 30 * HOUR + n * 12 * S;
        add((at, pump, "raised", "normal", "active", 64, ""));
        add((at + S / 2, pump, "returned", "active", "normal", 64, ""));
    }
    for n in 0..14 {
        let name = format!("zone-{n}.alarms.pressure");
        let at = 40 * HOUR + n * 10 * S;
        add((at, &name, "raised", "normal", "active", if n == 0 { 240 } else { 64 }, ""));
        add((at + 5 * M, &name, "returned", "active", "awaiting-reset", 64, ""));
    }
    add((41 * HOUR, "zone-0.alarms.pressure", "reset", "awaiting-reset", "normal", 240, "bob"));
    add((42 * HOUR, "zone-1.alarms.pressure", "shelved", "awaiting-reset", "shelved", 64, "bob"));
    all
}

#[test]
fn the_report_of_two_days() {
    let folder = journal(two_days(PUMP));
    let table = said(folder.path(), &["alarms", "report", "data"]);
    insta::assert_snapshot!("report_table", table.as_str());
    // The user's page shows this very report.
    let page = include_str!("../../../docs/alarm-report.md");
    let missing: Vec<_> = table.lines().map(str::trim).filter(|line| !page.contains(line)).collect();
    assert!(missing.is_empty(), "docs/alarm-report.md lacks {missing:#?}");
    insta::assert_snapshot!("report_json", said(folder.path(), &["alarms", "report", "data", "--format", "json"]));
}

#[test]
fn the_help_teaches() {
    let folder = TempDir::new().expect("a folder");
    insta::assert_snapshot!("help_alarms_report", said(folder.path(), &["alarms", "report", "--help"]));
}

/// The value of a figure of a report in JSON.
fn figure(json: &str, id: &str) -> f64 {
    let document: serde_json::Value = serde_json::from_str(json).expect("JSON");
    let figures = document["figures"].as_array().expect("figures").clone();
    let found = figures.iter().find(|f| f["id"] == id).unwrap_or_else(|| panic!("no figure {id}"));
    found["value"].as_f64().unwrap_or_else(|| panic!("no value of {id}"))
}

#[test]
fn a_part_of_the_time_and_of_the_alarms() {
    let folder = journal(two_days(PUMP));
    let raised = |more: &[&str]| {
        let args = [&["alarms", "report", "data", "--format", "json"], more].concat();
        figure(&said(folder.path(), &args), "raised")
    };
    assert_eq!(raised(&[]), 41.0);
    assert_eq!(raised(&["--to", "2026-11-26"]), 21.0);
    assert_eq!(raised(&["--from", "2026-11-26"]), 20.0);
    assert_eq!(raised(&["--from", "2026-11-25T01:00:00Z", "--to", "2026-11-25T02:00:00Z"]), 1.0);
    assert_eq!(raised(&["--only", "tank.*", "--only", "cooling.*"]), 21.0);
    assert_eq!(raised(&["--exclude", "zone-*"]), 27.0);
    assert_eq!(raised(&["--only", "zone-*", "--exclude", "zone-1*"]), 9.0);
}

#[test]
fn the_page_is_well_formed_whole_and_escapes_names() {
    let folder = journal(two_days(STRANGE));
    let args = ["alarms", "report", "data", "--format", "html", "--output", "report.html"];
    assert_eq!(said(folder.path(), &args), "");
    let page = std::fs::read_to_string(folder.path().join("report.html")).expect("the page");
    // A parser of XML 1.0 refuses them, which the one below does not.
    assert!(!page.contains(|c: char| c.is_control() && c != '\n'));
    let body = page.strip_prefix("<!DOCTYPE html>\n").expect("a page");
    let mut reader = quick_xml::Reader::from_str(body);
    reader.config_mut().check_end_names = true;
    let (mut depth, mut plots, mut texts) = (0, 0, String::new());
    loop {
        match reader.read_event().unwrap_or_else(|e| panic!("at {}: {e}", reader.error_position())) {
            quick_xml::events::Event::Start(tag) => {
                depth += 1;
                plots += usize::from(tag.name().as_ref() == b"svg");
                assert!(tag.attributes().all(|a| a.is_ok()), "{tag:?}");
                assert_ne!(tag.name().as_ref(), b"script");
            }
            quick_xml::events::Event::End(_) => depth -= 1,
            quick_xml::events::Event::Text(part) => texts += &part.decode().expect("UTF-8"),
            quick_xml::events::Event::GeneralRef(name) => {
                let name = name.decode().expect("UTF-8");
                texts += quick_xml::escape::resolve_predefined_entity(&name).expect("a known entity");
            }
            quick_xml::events::Event::Eof => break,
            _ => {}
        }
    }
    assert_eq!((depth, plots), (0, 3));
    // In the list, and beside its bar.
    assert!(texts.matches(SHOWN).count() >= 2, "{texts}");
    assert!(!page.contains("<miss>"), "the name of an alarm becomes a tag");
    // The namespace of the plots is a name, not a place that anything is fetched from.
    assert!(!page.replace("http://www.w3.org/2000/svg", "").contains("http"), "everything stands in the page");
}

#[test]
fn an_empty_journal_and_one_of_an_older_plant_have_reports_too() {
    let folder = journal(vec![lane(0, "started"), lane(HOUR, "stopped")]);
    for format in ["table", "json", "html"] {
        assert!(!said(folder.path(), &["alarms", "report", "data", "--format", format]).is_empty());
    }
    let json = said(folder.path(), &["alarms", "report", "data", "--format", "json"]);
    assert_eq!((figure(&json, "raised"), figure(&json, "per-hour")), (0.0, 0.0));
    let old = journal(vec![
        record((0, "a.alarms.x", "raised", "false", "true", 128, "")),
        record((M, "a.alarms.x", "returned", "true", "false", 128, "")),
        record((2 * M, "b.alarms.y", "raised", "false", "true", 128, "")),
    ]);
    let json = said(old.path(), &["alarms", "report", "data", "--format", "json"]);
    assert_eq!((figure(&json, "raised"), figure(&json, "active")), (2.0, 1.0));
}

#[test]
fn records_that_are_missing_are_told() {
    let mut records = two_days(PUMP);
    let row = (HOUR, "journal", "overflow", "", "", 200, "");
    records.push(Record { kind: Kind::Lost, current: Value::Integer(17), ..record(row) });
    // What a sink has not had was in the journal.
    let row = (HOUR, "journal", "retention", "", "", 200, "");
    records.push(Record { kind: Kind::Lost, current: Value::Integer(4_000), ..record(row) });
    let folder = journal(records);
    let out = said(folder.path(), &["alarms", "report", "data"]);
    assert!(out.contains("note: 17 records are missing from the journal"), "{out}");
}

#[test]
fn a_record_without_the_right_time_is_told_and_does_not_make_the_plant_look_good() {
    let mut records = two_days(PUMP);
    let rate =
        |folder: &TempDir| figure(&said(folder.path(), &["alarms", "report", "data", "--format", "json"]), "per-day");
    let right = rate(&journal(records.clone()));
    records.push(Record { time: 7 * S, ..lane(0, "started") });
    let folder = journal(records);
    assert_eq!(rate(&folder), right);
    let out = said(folder.path(), &["alarms", "report", "data"]);
    assert!(out.contains("note: the clock jumped once, by more than a day back or 90 days ahead; the period"), "{out}");
}

#[test]
fn what_is_wrong_is_told() {
    let folder = journal(two_days(PUMP));
    for (args, code, part) in [
        (vec!["data", "--from", "2026-11-26", "--to", "2026-11-25"], 2, "--from must be before --to"),
        (vec!["data", "--from", "soon"], 2, "2026-11-27T09:30:00Z"),
        (vec!["data", "--only", "a[b"], 2, "a[b"),
        (vec!["nowhere"], 1, "there is no journal in nowhere"),
        (vec!["data", "--output", "no/such/folder.html"], 1, "no/such/folder.html could not be written"),
    ] {
        let output = latchwork(folder.path(), &[&["alarms", "report"], args.as_slice()].concat());
        assert_eq!(output.status.code(), Some(code), "{args:?}");
        let errors = text(&output.stderr);
        assert!(errors.contains(part), "{args:?}: {errors}");
    }
}
