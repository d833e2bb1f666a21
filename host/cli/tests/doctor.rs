//! `latchwork doctor` on the machine that runs the tests, of which only little is known: what must hold on every machine.
//! What it says about others is tested where the checks are.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

fn doctor(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    let command = command.current_dir(folder).arg("doctor").args(args).env("COLUMNS", "100");
    command.output().expect("latchwork starts")
}

/// The findings, after comparing them with the exit code.
fn findings(folder: &Path, args: &[&str]) -> Vec<Value> {
    let output = doctor(folder, args);
    let list: Vec<Value> = serde_json::from_slice(&output.stdout).expect("a list as JSON");
    let bad = list.iter().any(|f| f["status"] == "bad");
    assert_eq!(output.status.code(), Some(i32::from(bad)), "{list:?}");
    list
}

fn status<'a>(findings: &'a [Value], check: &str) -> Option<&'a str> {
    findings.iter().find(|f| f["check"] == check).and_then(|f| f["status"].as_str())
}

fn plant(text: &str) -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    std::fs::write(folder.path().join("plant.toml"), text).expect("the plant file");
    folder
}

#[test]
fn scripts_get_a_list_of_which_each_entry_is_complete() {
    let folder = TempDir::new().expect("a temporary folder");
    let list = findings(folder.path(), &["--json"]);
    for finding in &list {
        let keys: Vec<&str> = finding.as_object().expect("an object").keys().map(String::as_str).collect();
        assert_eq!(keys, ["check", "found", "mend", "status", "why"]);
        for key in ["check", "found", "why"] {
            assert!(finding[key].as_str().is_some_and(|t| !t.is_empty()), "{finding}");
        }
        assert!(["ok", "note", "bad"].iter().any(|s| finding["status"] == *s), "{finding}");
    }
    for check in ["real-time-priority", "memory-lock", "kernel-preemption", "cpu-governor", "cache-folder", "watchdog"]
    {
        assert!(status(&list, check).is_some(), "{check} is missing");
    }
    assert_eq!(status(&list, "serial-ports"), None, "only a plant says which ports it needs");
}

#[test]
fn people_get_a_table_without_colours_in_a_pipe() {
    let folder = TempDir::new().expect("a temporary folder");
    let output = doctor(folder.path(), &["--no-cache"]);
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(text.starts_with("This machine") && !text.contains('\x1b'), "{text}");
    assert!(text.contains("real-time-priority") && !text.contains("cache-folder"), "{text}");
    let ready = text.contains("\nReady.");
    assert_eq!((ready, output.status.code()), (output.status.success(), Some(i32::from(!ready))), "{text}");
}

#[test]
fn a_plant_is_asked_what_it_needs() {
    let components = Path::new(env!("CARGO_BIN_EXE_latchwork")).ancestors().nth(2).expect("target").join("components");
    assert!(components.is_dir(), "{} is missing: run `cargo xtask guests` first", components.display());
    let folder = plant(&format!(
        r#"[plant]
name = "far"
components = [{:?}]
[lane.main]
every = "10ms"
cpu = 1000
[driver.line]
kind = "modbus-rtu"
device = "/dev/there-is-no-such-port"
[driver.line.points]
start = {{ coil = 0 }}
[block.delay]
component = "ton"
lane = "main"
inputs.in = "line.start"
inputs.pt = "1s"
"#,
        components.display().to_string()
    ));
    let list = findings(folder.path(), &["plant.toml", "--json", "--no-cache"]);
    assert_eq!(status(&list, "lane-cpus"), Some("bad"));
    assert_eq!(status(&list, "serial-ports"), Some("bad"));
    assert_ne!(status(&list, "watchdog"), Some("bad"), "it names no watchdog");
    let output = doctor(folder.path(), &["plant.toml", "--no-cache"]);
    let text = String::from_utf8(output.stdout).expect("text");
    assert!(text.starts_with("This machine for plant far\n"), "{text}");
    assert!(text.contains("Not ready: "), "{text}");
}

#[test]
fn a_plant_file_with_errors_shows_them() {
    let folder = plant("[plant]\nname = \"x\"\n[lane.main]\nevery = \"10 parsecs\"\n");
    let output = doctor(folder.path(), &["plant.toml", "--json", "--no-cache"]);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0));
    assert!(String::from_utf8_lossy(&output.stderr).contains("10 parsecs"));
}

#[test]
fn help() {
    let folder = TempDir::new().expect("a temporary folder");
    let output = doctor(folder.path(), &["--help"]);
    assert!(output.status.success());
    insta::assert_snapshot!("help_doctor", String::from_utf8(output.stdout).expect("text"));
}
