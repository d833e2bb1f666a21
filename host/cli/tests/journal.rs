//! `run --data`, `journal verify`, `journal export`: records that outlive the process.

use latchwork_image::Value;
use latchwork_record::journal::{Filter, Journal, Options, Reader};
use latchwork_record::{Kind, Record};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

fn latchwork() -> Command {
    Command::new(env!("CARGO_BIN_EXE_latchwork"))
}

/// A plant with an event record every 2 ms.
fn plant(folder: &Path) -> PathBuf {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    let target = exe.ancestors().nth(2).expect("the binary stands in target/release");
    let components = ["components", "test-components"].map(|f| format!("{:?}", target.join(f).display().to_string()));
    let text = format!(
        "[plant]\nname = \"busy\"\ncomponents = [{}]\n[lane.main]\nevery = \"1ms\"\nwatchdog = \"10s\"\n\
         [block.clock]\ncomponent = \"multivibrator\"\nlane = \"main\"\nbudget = \"1s\"\ninputs.run = true\n\
         settings = {{ on-time = \"2ms\", off-time = \"2ms\" }}\n\
         [block.seen]\ncomponent = \"interlock-probe\"\nlane = \"main\"\nbudget = \"1s\"\ninputs.b = \"clock.outputs.out\"\n\
         [[alarm]]\nmatch = \"clock.outputs.out\"\ncode = 0xC400\non-delay = \"1ms\"\n\
         [[alarm]]\nmatch = \"seen.outputs.b\"\ncode = 0xCC00\nsuppress-when = \"clock.outputs.out\"\n",
        components.join(", ")
    );
    let path = folder.join("plant.toml");
    std::fs::write(&path, text).expect("the plant file");
    path
}

/// Exit code, output and errors.
fn run(args: &[&str], data: &Path) -> (Option<i32>, String, String) {
    let output = latchwork().args(args).arg(data).output().expect("latchwork starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn verdict(data: &Path) -> serde_json::Value {
    let (code, out, errors) = run(&["journal", "verify", "--json"], data);
    assert_eq!(code, Some(0), "{out}{errors}");
    serde_json::from_str(&out).expect("JSON")
}

#[test]
fn a_plant_that_is_killed_again_and_again_keeps_its_records_in_order() {
    let folder = TempDir::new().expect("a folder");
    let (plant, data) = (plant(folder.path()), folder.path().join("data"));
    let (mut last, mut random) = (0, 99u64);
    for round in 0..20 {
        let mut child = latchwork()
            .args(["run", "--quiet", "--data"])
            .arg(&data)
            .arg(&plant)
            .stdout(Stdio::null())
            .spawn()
            .expect("latchwork starts");
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        std::thread::sleep(Duration::from_millis(250 + (random >> 40) % 200));
        child.kill().expect("it runs");
        child.wait().expect("it has ended");
        // A slow machine may not have begun the journal yet.
        if last == 0 && run(&["journal", "verify"], &data).2.contains("there is no journal") {
            continue;
        }
        let found = verdict(&data);
        let now = found["last"].as_u64().unwrap_or(0);
        assert_eq!(found["records"].as_u64(), Some(now), "round {round}: {found}");
        assert!(now >= last, "round {round}: {last} were there, now {now}");
        last = now;
        alarms_are_as_the_journal_tells(&data);
    }
    assert!(last > 200, "only {last} records");
}

/// The kept state of each alarm is that of its last record: they were written as one.
fn alarms_are_as_the_journal_tells(data: &Path) {
    let reader = Reader::open(data).expect("a journal");
    let records = reader.records(Filter::default(), usize::MAX).expect("records");
    let kept = reader.kept().expect("states");
    for alarm in ["clock.outputs.out", "seen.outputs.b"] {
        let last = records.iter().rfind(|r| r.kind == Kind::Alarm && r.source == alarm);
        let state =
            kept.get(&format!("alarm/{alarm}")).map(|s| serde_json::from_str::<serde_json::Value>(s).expect("JSON"));
        let (Some(last), Some(state)) = (last, &state) else {
            assert_eq!(
                (last, state.as_ref()),
                (None, None),
                "{alarm}: a record without a state, or a state without a record"
            );
            continue;
        };
        assert_eq!(state["seq"].as_u64(), Some(last.seq), "{alarm}: {state} after {last:?}");
        let is = |key: &str| state[key] == true;
        let shown = match (is("suppressed"), is("active"), is("unacknowledged"), is("latched")) {
            (true, ..) => "suppressed",
            (_, true, true, _) => "unacknowledged",
            (_, true, false, _) => "active",
            (_, false, true, _) => "returned",
            (_, false, false, true) => "awaiting-reset",
            (_, false, false, false) => "normal",
        };
        assert_eq!(last.current.to_string(), shown, "{alarm}: {state} after {last:?}");
    }
}

#[test]
fn an_orderly_run_is_in_the_journal_whole_and_can_be_exported() {
    let folder = TempDir::new().expect("a folder");
    let (plant, data) = (plant(folder.path()), folder.path().join("data"));
    let records = folder.path().join("records.jsonl");
    for _ in 0..2 {
        let status = latchwork()
            .args(["run", "--quiet", "--speed", "max", "--for", "1s", "--data"])
            .arg(&data)
            .arg("--records")
            .arg(&records)
            .arg(&plant)
            .stdout(Stdio::null())
            .status();
        assert!(status.expect("latchwork starts").success());
    }
    let file = std::fs::read_to_string(&records).expect("records");
    let count = file.lines().count();
    assert_eq!(verdict(&data)["records"].as_u64(), Some(2 * count as u64));
    let (code, out, _) = run(&["journal", "export"], &data);
    assert_eq!(code, Some(0));
    // The second run's records are the same in file and journal, number for number.
    let second: Vec<&str> = out.lines().skip(count).collect();
    assert_eq!(second, file.lines().collect::<Vec<_>>());

    let csv = folder.path().join("stick.csv");
    let status = latchwork()
        .args(["journal", "export", "--format", "csv", "--to", "1970-01-01T00:00:00.5Z", "-o"])
        .arg(&csv)
        .arg(&data)
        .status();
    assert!(status.expect("latchwork starts").success());
    let text = std::fs::read_to_string(&csv).expect("the file");
    assert!(
        text.starts_with("seq,time,kind,source,transition,previous,current,priority,user,text\n1,1970-01-01T00:00:00")
    );
    let rows = csv::Reader::from_reader(text.as_bytes()).records().filter_map(Result::ok).count();
    let early = out.lines().filter(|l| l.contains("\"time\":\"1970-01-01T00:00:00.") && *l < "~").count();
    assert!(rows > 100 && rows < early, "{rows} of {early}");
}

#[test]
fn the_summary_counts_the_records_of_its_own_run() {
    let folder = TempDir::new().expect("a folder");
    let (plant, records) = (plant(folder.path()), folder.path().join("records.jsonl"));
    for _ in 0..2 {
        let output = latchwork()
            .args(["run", "--speed", "max", "--for", "100ms", "--data"])
            .arg(folder.path().join("data"))
            .arg("--records")
            .arg(&records)
            .arg(&plant)
            .output()
            .expect("latchwork starts");
        let said = String::from_utf8(output.stdout).expect("UTF-8");
        let count = std::fs::read_to_string(&records).expect("records").lines().count();
        assert!(count > 10 && said.contains(&format!("\n{count} records (")), "{count}: {said}");
    }
}

#[test]
fn no_text_in_a_csv_is_a_formula() {
    let folder = TempDir::new().expect("a folder");
    let record = |seq, source: &str, text: &str, current| Record {
        seq,
        time: seq,
        kind: Kind::Audit,
        source: source.into(),
        transition: "written".into(),
        previous: Value::Integer(-1),
        current,
        priority: 0,
        user: "@anna".into(),
        text: text.into(),
    };
    let (mut journal, _) = Journal::open(folder.path(), Options::default()).expect("a journal");
    journal.push(&record(1, "+x", "=HYPERLINK(\"http://x\")", Value::Text("-2+3".into())));
    journal.push(&record(2, "x", "a = b", Value::Real(-0.5)));
    assert_eq!(journal.close(), 0);
    let (code, out, _) = run(&["journal", "export", "--format", "csv"], folder.path());
    assert_eq!(code, Some(0));
    let mut reader = csv::Reader::from_reader(out.as_bytes());
    let rows: Vec<Vec<String>> =
        reader.records().map(|r| r.expect("a row").iter().skip(3).map(String::from).collect()).collect();
    assert_eq!(rows[0], ["'+x", "written", "-1", "'-2+3", "0", "'@anna", "'=HYPERLINK(\"http://x\")"]);
    assert_eq!(rows[1], ["x", "written", "-1", "-0.5", "0", "'@anna", "a = b"]);
    let (_, lines, _) = run(&["journal", "export"], folder.path());
    assert!(lines.contains("\"source\":\"+x\"") && lines.contains("\"text\":\"=HYPERLINK("), "{lines}");
}

#[test]
fn what_is_wrong_is_told() {
    let folder = TempDir::new().expect("a folder");
    let (code, _, errors) = run(&["journal", "verify"], folder.path());
    assert_eq!(code, Some(1));
    assert!(errors.contains("there is no journal in") && errors.contains("--data"), "{errors}");
    let (code, _, errors) = run(&["journal", "export", "--from", "yesterday"], folder.path());
    assert_eq!(code, Some(2));
    assert!(errors.contains("2026-11-27T09:30:00Z"), "{errors}");
    // A folder that is no folder.
    let plant = plant(folder.path());
    let (code, _, errors) =
        run(&["run", "--speed", "max", "--for", "1s", &plant.display().to_string(), "--data"], &plant);
    assert_eq!(code, Some(1));
    assert!(errors.contains("the data folder") && errors.contains("cannot be used"), "{errors}");
}

#[test]
fn a_damaged_journal_is_set_aside_and_said_loudly() {
    let folder = TempDir::new().expect("a folder");
    let (plant, data) = (plant(folder.path()), folder.path().join("data"));
    let once = |extra: &[&str]| {
        let status = latchwork()
            .args(["run", "--quiet", "--speed", "max", "--for", "100ms", "--data"])
            .arg(&data)
            .args(extra)
            .arg(&plant)
            .stdout(Stdio::null())
            .status();
        assert!(status.expect("latchwork starts").success());
    };
    once(&[]);
    let mut bytes = std::fs::read(data.join("journal.db")).expect("the journal");
    bytes[..64].fill(0xff);
    std::fs::write(data.join("journal.db"), bytes).expect("the journal");
    let (code, ..) = run(&["journal", "verify"], &data);
    assert_eq!(code, Some(1));
    once(&[]);
    assert!(data.join("journal.damaged-1.db").is_file());
    let (_, out, _) = run(&["journal", "export"], &data);
    assert!(out.contains("\"source\":\"journal\",\"transition\":\"damaged\""), "{out}");
    assert!(verdict(&data)["first"].as_u64() > Some(100), "no number comes twice");
}

#[test]
fn sinks_get_what_the_journal_has_and_idle_without_one() {
    let folder = TempDir::new().expect("a folder");
    let (plant, data) = (plant(folder.path()), folder.path().join("data"));
    let mut text = std::fs::read_to_string(&plant).expect("the plant file");
    text += "[sink.file]\nkind = \"jsonl\"\npath = \"log/all.jsonl\"\n[sink.lane]\nkind = \"jsonl\"\n\
             path = \"log/lane.jsonl\"\nkinds = [\"lane\"]\n[sink.away]\nkind = \"mqtt\"\naddress = \"127.0.0.1\"\nport = 1\n";
    std::fs::write(&plant, text).expect("the plant file");
    let run = |args: &[&str]| {
        let output = latchwork().args(["run", "--quiet"]).args(args).arg(&plant).output().expect("latchwork starts");
        let errors = String::from_utf8(output.stderr).expect("UTF-8");
        assert!(output.status.success(), "{errors}");
        errors
    };
    let shown = data.display().to_string();
    for args in
        [["--speed", "max", "--for", "1s", "--data", &shown], ["--speed", "real", "--for", "1s", "--data", &shown]]
    {
        assert_eq!(run(&args), "");
    }
    let (_, all, _) = self::run(&["journal", "export"], &data);
    let read = |name: &str| std::fs::read_to_string(folder.path().join("log").join(name)).expect("the sink's file");
    assert_eq!(read("all.jsonl"), all);
    let lane: String = all.lines().filter(|l| l.contains("\"kind\":\"lane\"")).map(|l| format!("{l}\n")).collect();
    assert!(!lane.is_empty());
    assert_eq!(read("lane.jsonl"), lane);
    let refused = all.lines().filter(|l| l.contains("\"source\":\"sink.away\",\"transition\":\"refused\"")).count();
    assert!(refused == 1 || refused == 2, "once a run, if it is noticed before its end: {refused}");
    let errors = run(&["--speed", "max", "--for", "100ms"]);
    assert!(errors.contains("nothing goes to `file`, `lane`, `away`") && errors.contains("--data FOLDER"), "{errors}");
    assert_eq!(read("all.jsonl"), all);
}
