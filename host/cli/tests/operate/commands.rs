//! Every command does at the plant what it says.

use crate::support::{LONG, start};
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::Stdio;

#[test]
fn an_alarm_is_seen_acknowledged_and_reset_and_the_records_say_by_whom() {
    let plant = start("");
    assert_eq!(plant.does(&["alarms"]), "no alarms\n");
    assert!(plant.does(&["set", "field.smoke=true"]).contains("field.smoke is true now"));
    plant.until_alarm_is("fire.alarms.alarm", "unacknowledged");
    let list = plant.does(&["alarms"]);
    assert!(
        list.contains("fire.alarms.alarm") && list.contains("smoke in the hall") && list.contains("there"),
        "{list}"
    );
    let seen = plant.json(&["alarms"])[0]["seq"].as_u64().expect("a number");
    assert!(list.contains(&format!("newest record: {seen} ")), "{list}");
    // What was not seen is not acknowledged.
    plant.refuses(&["ack", "fire.alarms.alarm", "--seen", &(seen - 1).to_string()]);
    plant.until_alarm_is("fire.alarms.alarm", "unacknowledged");
    let done = plant.does(&["ack", "fire.*", "--reason", "on my way"]);
    assert!(done.contains("fire.alarms.alarm"), "{done}");
    plant.until_alarm_is("fire.alarms.alarm", "active");
    assert!(plant.refuses(&["reset", "fire.alarms.alarm"]).contains("still there"));
    plant.does(&["set", "field.smoke=false"]);
    plant.until_alarm_is("fire.alarms.alarm", "awaiting-reset");
    plant.does(&["reset", "fire.alarms.alarm"]);
    plant.until_alarm_is("fire.alarms.alarm", "normal");
    assert_eq!(plant.does(&["alarms"]), "no alarms\n");

    plant.does(&["shelve", "fire.alarms.alarm", "--for", "10m", "--reason", "detector is cleaned"]);
    let shelved = plant.does(&["alarms"]);
    assert!(shelved.contains("shelved until "), "{shelved}");
    plant.does(&["unshelve", "fire.alarms.alarm"]);
    plant.does(&["out-of-service", "fire.alarms.alarm"]);
    plant.until_alarm_is("fire.alarms.alarm", "out-of-service");
    plant.does(&["in-service", "fire.alarms.alarm"]);
    plant.until_alarm_is("fire.alarms.alarm", "normal");

    let of_alarm = |r: &Value| r["kind"] == "alarm" && r["source"] == "fire.alarms.alarm";
    let records = plant.records(8, of_alarm);
    let told: Vec<_> =
        records.iter().map(|r| [&r["transition"], &r["user"]].map(|v| v.as_str().unwrap_or_default())).collect();
    let expected = [
        ["raised", ""],
        ["acknowledged", "root"],
        ["returned", ""],
        ["reset", "root"],
        ["shelved", "root"],
        ["unshelved", "root"],
        ["out-of-service", "root"],
        ["in-service", "root"],
    ];
    if rustix::process::geteuid().is_root() {
        assert_eq!(told, expected);
    }
    let why = records[1]["text"].as_str().expect("a text");
    assert!(why.contains("because on my way") && why.contains("from script"), "{why}");
    // The same, as a person reads it.
    let line = plant.does(&["records", "--kind", "alarm", "--source", "fire.*", "-n", "1"]);
    assert!(line.contains("fire.alarms.alarm  in-service") && line.contains("  by "), "{line}");
}

#[test]
fn settings_are_shown_staged_written_refused_and_discarded() {
    let plant = start("");
    let pulse = || plant.json(&["set", "--show", "unit"])[0]["value"].clone();
    assert_eq!(pulse(), "200ms");
    assert!(
        plant.does(&["set", "unit.settings.pulse=300ms", "--stage"]).contains("300ms is staged, 200ms is in effect")
    );
    let shown = plant.does(&["set", "--show", "unit"]);
    assert!(shown.contains("unit.settings.pulse (staged)") && pulse() == "200ms", "{shown}");
    assert!(
        plant.does(&["set", "--write", "unit", "--reason", "horn too short"]).contains("is 300ms now, it was 200ms")
    );
    assert_eq!(pulse(), "300ms");
    // Two that fit together only, at once.
    plant.does(&["set", "unit.settings.low-limit=52", "unit.settings.high-limit=55"]);
    let why = plant.refuses(&["set", "unit.settings.low-limit=60"]);
    assert!(why.contains("`unit` refuses the settings"), "{why}");
    // What was refused is not tried again with the next value, and what others stage is theirs.
    plant.does(&["set", "unit.settings.veracity-time=70ms", "--stage"]);
    plant.does(&["set", "unit.settings.pulse=301ms"]);
    assert!(plant.does(&["set", "--show", "unit"]).contains("unit.settings.veracity-time (staged)"));
    plant.does(&["set", "unit.settings.pulse=300ms"]);
    let why = plant.refuses(&["set", "unit.settings.pulse=soon"]);
    assert!(why.contains("unit.settings.pulse"), "{why}");
    assert!(plant.refuses(&["set", "unit.settings.puls=1s"]).contains("did you mean `unit.settings.pulse`?"));
    plant.does(&["set", "unit.settings.pulse=9s", "--stage"]);
    plant.does(&["set", "--discard", "unit"]);
    assert!(plant.refuses(&["set", "--write", "unit"]).contains("nothing is staged"));
    assert_eq!(pulse(), "300ms");
    let written = plant.records(3, |r| r["kind"] == "setting" && r["transition"] == "written");
    let told = [&written[0]["source"], &written[0]["previous"], &written[0]["current"]];
    assert_eq!(told, ["unit.settings.pulse", "200ms", "300ms"]);
    assert!(written[0]["text"].as_str().is_some_and(|t| t.contains("because horn too short")), "{}", written[0]);
    plant.records(1, |r| r["kind"] == "setting" && r["transition"] == "refused");
}

#[test]
fn forces_commands_and_values_are_seen_at_once() {
    let plant = start("");
    let value = |tag: &str| {
        let mut command =
            plant.command(Path::new(env!("CARGO_BIN_EXE_latchwork")), &["watch", tag, "--json", "--every", "50ms"]);
        let mut child = command.stdout(Stdio::piped()).spawn().expect("it starts");
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("its output")).read_line(&mut line).expect("a line");
        child.kill().expect("it runs");
        child.wait().expect("it ends");
        serde_json::from_str::<Value>(&line).expect("a row")
    };
    assert_eq!(plant.does(&["force"]), "nothing is forced\n");
    let held = plant.does(&["force", "field.level=32000", "field.door=true", "--reason", "transmitter is replaced"]);
    assert!(held.contains("field.level is held at 32000\n") && held.contains("field.door is held at true"), "{held}");
    let row = value("field.level");
    assert_eq!((&row["value"], &row["forced"]), (&32_000.into(), &true.into()));
    let list = plant.does(&["force"]);
    assert!(list.lines().any(|l| l.contains("field.level") && l.contains("32000")), "{list}");
    assert!(plant.refuses(&["force", "field.level=full"]).contains("field.level"));
    plant.does(&["unforce", "field.*"]);
    assert_eq!(plant.does(&["force"]), "nothing is forced\n");
    assert!(plant.does(&["command", "unit.commands.acknowledge"]).contains("given for one execution"));
    assert!(plant.refuses(&["command", "unit.commands.acknowlege"]).contains("acknowledge"));
    plant.does(&["heartbeat"]);
    plant.records(2, |r| r["kind"] == "audit" && r["transition"] == "forced");
    plant.records(2, |r| r["kind"] == "audit" && r["transition"] == "unforced");
    plant.records(1, |r| r["kind"] == "command" && r["source"] == "unit.commands.acknowledge");
    let status = plant.does(&["status"]);
    assert!(status.contains("pumps") && status.contains("lanes") && status.contains("main"), "{status}");
    assert_eq!(plant.json(&["status"])["plant"], "pumps");
}

#[test]
fn what_is_followed_ends_with_the_plant_and_says_so() {
    let mut plant = start("");
    let program = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    let mut followers: Vec<_> =
        [&["records", "--follow", "--json", "--source", "unit.commands.*"][..], &["watch", "field.level"]]
            .iter()
            .map(|args| {
                let mut command = plant.command(program, args);
                command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts")
            })
            .collect();
    // Each has begun when its first line is there.
    let mut outputs: Vec<_> =
        followers.iter_mut().map(|f| BufReader::new(f.stdout.take().expect("its output"))).collect();
    let mut lines = [String::new(), String::new()];
    outputs[1].read_line(&mut lines[1]).expect("a line");
    assert!(lines[1].contains("field.level = 15000"), "{}", lines[1]);
    let end = std::time::Instant::now() + LONG;
    let (sender, first) = std::sync::mpsc::channel();
    let mut records = outputs.remove(0);
    let reader = std::thread::spawn(move || {
        let mut line = String::new();
        records.read_line(&mut line).expect("a line");
        let _ = sender.send(line);
        records
    });
    // Something happens again and again until the follower is there to see it.
    let line = loop {
        plant.does(&["command", "unit.commands.silence"]);
        match first.recv_timeout(std::time::Duration::from_millis(300)) {
            Ok(line) => break line,
            Err(_) => assert!(std::time::Instant::now() < end, "no record came"),
        }
    };
    let record: Value = serde_json::from_str(&line).expect("a record");
    assert_eq!(record["source"], "unit.commands.silence");
    let pid = rustix::process::Pid::from_child(&plant.child);
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).expect("it runs");
    assert_eq!(plant.child.wait().expect("it ends").code(), Some(0));
    drop(reader.join().expect("no panic"));
    for follower in followers {
        let output = follower.wait_with_output().expect("it ends");
        let errors = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(errors.contains("the plant has"), "{errors}");
    }
    assert!(!plant.socket().exists(), "the socket is removed");
    let why = plant.refuses(&["status"]);
    assert!(why.contains("no plant listens at") && why.contains("latchwork run PLANT --socket"), "{why}");
}

#[test]
fn wrong_command_lines_are_told_with_exit_code_2() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut seen = String::new();
    for args in [
        &["ack"][..],
        &["reset"],
        &["shelve", "a"],
        &["shelve", "a", "--for", "30"],
        &["set"],
        &["set", "unit.settings.pulse"],
        &["set", "--write", "unit", "--show", "unit"],
        &["set", "--write", "unit", "--stage"],
        &["command"],
        &["command", "a", "--on", "--off"],
        &["records", "--follow", "--to", "2026-11-27"],
        &["swap"],
        &["swap", "unit"],
        &["swap", "unit", "unit-2.so", "--yes"],
        &["swap", "unit", "unit-2.wasm"],
        &["swap", "unit", "unit-2.wasm", "fire", "--yes"],
        &["swap", "unit", "a.wasm", "--yes", "--tolerance", "unit.outputs.level"],
        &["swap", "unit", "a.wasm", "--yes", "--tolerance", "unit.outputs.level=-1"],
        &["swap", "unit", "a.wasm", "--yes", "--set", "pulse=300ms"],
        &["swap", "unit", "a.wasm", "--yes", "--shadow", "many"],
        &["rollback", "unit"],
        &["rollback", "unit", "--yes", "--steps", "0"],
        &["swaps", "--cancel"],
        &["run", "plant.toml", "--speed", "max", "--for", "1s", "--socket", "x.sock"],
    ] {
        if args[0] == "run" {
            let text = "[plant]\nname = \"p\"\n";
            std::fs::write(folder.path().join("plant.toml"), text).expect("the plant file");
        }
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_latchwork"));
        command.args(args).current_dir(folder.path()).env("COLUMNS", "100").env("NO_COLOR", "1");
        command.env_remove("LATCHWORK_SOCKET");
        let (code, out, errors) = crate::support::said(&mut command);
        assert!(!errors.contains("panicked"), "{errors}");
        seen += &format!(
            "$ latchwork {}\n{out}{}\n[exit code {}]\n\n",
            args.join(" "),
            errors.trim_end(),
            code.unwrap_or(-1)
        );
    }
    insta::assert_snapshot!(seen);
}
