//! The command line as a user meets it: help, exit codes, files, wrong inputs.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// `latchwork` with its cache in the build folder and a terminal of fixed width.
fn latchwork(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    let cache = target().join("test-cache");
    command.current_dir(folder).env("XDG_CACHE_HOME", cache).env("COLUMNS", "100").env("NO_COLOR", "1");
    command.env_remove("LATCHWORK_CACHE");
    command
}

fn target() -> PathBuf {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    exe.ancestors().nth(2).expect("the binary stands in target/release").to_path_buf()
}

fn components() -> PathBuf {
    let folder = target().join("components");
    assert!(folder.is_dir(), "{} is missing: run `cargo xtask guests` first", folder.display());
    folder
}

/// A folder with a plant of one timer on sim points, and a stimulus.
fn stairs() -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    let plant = format!(
        r#"[plant]
name = "stairs"
components = [{:?}]

[lane.main]
every = "10ms"

[driver.hall]
kind = "sim"
[driver.hall.points]
button = {{ type = "bool" }}
lamp = {{ type = "bool", from = "light.outputs.q" }}

[block.light]
component = "tof"
lane = "main"
inputs.in = "hall.button"
inputs.pt = "2s"
"#,
        components().display().to_string()
    );
    std::fs::write(folder.path().join("stairs.toml"), plant).expect("the plant file");
    std::fs::write(folder.path().join("push.csv"), "time,tag,value\n1s,hall.button,true\n1.2s,hall.button,false\n")
        .expect("the stimulus");
    folder
}

fn run(folder: &Path, args: &[&str]) -> Output {
    latchwork(folder).args(args).output().expect("latchwork starts")
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("text")
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("text")
}

#[test]
fn help_teaches() {
    let folder = TempDir::new().expect("a temporary folder");
    for (name, args) in [
        ("help", vec!["--help"]),
        ("help_run", vec!["run", "--help"]),
        ("help_check", vec!["check", "--help"]),
        ("help_inspect", vec!["inspect", "--help"]),
        ("help_tags", vec!["tags", "--help"]),
        ("help_schema", vec!["schema", "--help"]),
        ("help_set", vec!["set", "--help"]),
        ("help_swap", vec!["swap", "--help"]),
        ("help_ack", vec!["ack", "--help"]),
        ("help_records", vec!["records", "--help"]),
    ] {
        let output = run(folder.path(), &args);
        assert!(output.status.success());
        insta::assert_snapshot!(name, stdout(&output));
    }
}

#[test]
fn a_plant_runs_at_virtual_time_and_two_runs_are_equal_to_the_byte() {
    let folder = stairs();
    let files = |n: u32| [format!("trace{n}.csv"), format!("records{n}.jsonl")];
    for n in 1..=2 {
        let [trace, records] = files(n);
        let args = [
            "run",
            "stairs.toml",
            "--speed",
            "max",
            "--for",
            "5s",
            "--stimulus",
            "push.csv",
            "--trace",
            &trace,
            "--records",
            &records,
        ];
        let output = run(folder.path(), &args);
        assert!(output.status.success(), "{}", stderr(&output));
    }
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect(name);
    assert_eq!(read(&files(1)[0]), read(&files(2)[0]));
    assert_eq!(read(&files(1)[1]), read(&files(2)[1]));
    insta::assert_snapshot!("trace", read(&files(1)[0]));
    insta::assert_snapshot!("records", read(&files(1)[1]));
}

#[test]
fn the_summary_is_for_people_or_for_scripts() {
    let folder = stairs();
    let args = ["run", "stairs.toml", "--speed", "max", "--for", "5s"];
    insta::assert_snapshot!("summary", stdout(&run(folder.path(), &args)));
    let output = run(folder.path(), &[&args[..], &["--json"]].concat());
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
    assert_eq!(json["lanes"][0]["scans"], 500);
    assert_eq!(json["faulted"], false);
}

#[test]
fn exit_codes_and_messages_of_wrong_command_lines() {
    let folder = stairs();
    let real = std::fs::read_to_string(folder.path().join("stairs.toml"))
        .expect("the plant file")
        .replace("kind = \"sim\"", "kind = \"modbus-tcp\"\naddress = \"127.0.0.1:1\"")
        .replace("button = { type = \"bool\" }", "button = { discrete-input = 0 }")
        .replace("lamp = { type = \"bool\", ", "lamp = { coil = 0, ");
    std::fs::write(folder.path().join("real.toml"), real).expect("the plant file");
    std::fs::write(
        folder.path().join("wrong.csv"),
        "time,tag,value\n1s,hall.buton,true\n2s,hall.button,7\n3s,light.outputs.q,true\n",
    )
    .expect("the stimulus");
    std::fs::write(folder.path().join("core.wasm"), b"\0asm\x01\0\0\0").expect("a core module");
    let mut seen = String::new();
    for (args, code) in [
        (vec!["run"], 2),
        (vec!["rnu", "stairs.toml"], 2),
        (vec!["run", "stairs.toml", "--for", "10"], 2),
        (vec!["run", "stairs.toml", "--for", "1s", "--scans", "3"], 2),
        (vec!["run", "real.toml", "--speed", "max", "--for", "1s"], 2),
        (vec!["run", "stairs.toml", "--speed", "max"], 2),
        (vec!["run", "stairs.toml", "--speed", "max", "--for", "1s", "--trace", "x", "--records", "x"], 2),
        (vec!["run", "missing.toml"], 1),
        (vec!["check", "missing.toml"], 1),
        (vec!["run", "stairs.toml", "--speed", "max", "--for", "1s", "--stimulus", "missing.csv"], 1),
        (vec!["run", "stairs.toml", "--speed", "max", "--for", "1s", "--stimulus", "wrong.csv"], 1),
        (vec!["run", "stairs.toml", "--speed", "max", "--for", "1s", "--trace", "no/such/folder.csv"], 1),
        (vec!["run", "stairs.toml", "--speed", "max", "--for", "1s", "--trace", "t.csv", "--trace-tags", "[a"], 1),
        (vec!["inspect", "missing.wasm"], 1),
        (vec!["inspect", "core.wasm"], 1),
        (vec!["inspect", "stairs.toml"], 1),
    ] {
        let output = run(folder.path(), &args);
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(code), "latchwork {}: {text}", args.join(" "));
        assert!(!text.contains("panicked"), "latchwork {}: {text}", args.join(" "));
        seen += &format!("$ latchwork {}\n{}\n[exit code {code}]\n\n", args.join(" "), text.trim_end());
    }
    insta::assert_snapshot!("wrong_command_lines", seen);
}

#[test]
fn a_reader_that_goes_away_ends_nothing() {
    let folder = stairs();
    for (args, code) in [
        (vec!["run", "stairs.toml", "--speed", "max", "--for", "1m"], 0),
        (vec!["tags", "stairs.toml"], 0),
        (vec!["schema"], 0),
    ] {
        let mut child = latchwork(folder.path())
            .args(&args)
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .expect("it starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(code), "{args:?}: {}", stderr(&output));
    }
}

#[test]
fn a_stopped_lane_is_exit_code_3() {
    let folder = stairs();
    let text = std::fs::read_to_string(folder.path().join("stairs.toml")).expect("the plant file");
    let bad = "\n[block.bad]\ncomponent = \"stress\"\nlane = \"main\"\non-fault = \"stop-lane\"\ninputs.fault = \"trap\"\ninputs.from = 10\n";
    std::fs::write(folder.path().join("stairs.toml"), text + bad).expect("the plant file");
    let output = run(folder.path(), &["run", "stairs.toml", "--speed", "max", "--for", "5s"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    insta::assert_snapshot!("stopped_lane", stdout(&output));
}

#[test]
fn check_tags_inspect_and_schema_speak_to_people_and_scripts() {
    let folder = stairs();
    let check = run(folder.path(), &["check", "stairs.toml"]);
    assert!(check.status.success(), "{}", stderr(&check));
    insta::assert_snapshot!("check", stdout(&check));
    insta::assert_snapshot!("tags", stdout(&run(folder.path(), &["tags", "stairs.toml"])));
    let tof = components().join("tof.wasm").display().to_string();
    let inspect = stdout(&run(folder.path(), &["inspect", &tof]));
    // Size and hash change with each compiler; the rest is the contract.
    let from_imports = inspect.find("imports:").expect("imports");
    insta::assert_snapshot!("inspect", &inspect[from_imports..]);
    for args in [
        vec!["check", "stairs.toml", "--json"],
        vec!["tags", "stairs.toml", "--json"],
        vec!["inspect", &tof, "--json"],
        vec!["schema"],
    ] {
        let output = run(folder.path(), &args);
        assert!(output.status.success(), "{args:?}: {}", stderr(&output));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap_or_else(|e| panic!("{args:?}: {e}"));
    }
}
