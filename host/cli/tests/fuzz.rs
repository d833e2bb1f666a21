//! `latchwork fuzz` and `latchwork check-block` as a user meets them. What differs from run to run and from machine to machine
//! is left out.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

fn target() -> PathBuf {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    exe.ancestors().nth(2).expect("the binary stands in target/release").to_path_buf()
}

/// A folder with some components under the names that they were built by.
fn folder() -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    for name in ["components/ton", "components/bounds-check", "components/csv-days", "test-components/defects"] {
        let from = target().join(name).with_extension("wasm");
        let to = folder.path().join(from.file_name().expect("a name"));
        std::fs::copy(&from, to).unwrap_or_else(|e| panic!("{}: {e}; run `cargo xtask guests` first", from.display()));
    }
    std::fs::write(folder.path().join("core.wasm"), b"\0asm\x01\0\0\0").expect("a core module");
    folder
}

fn latchwork(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.current_dir(folder).env("XDG_CACHE_HOME", target().join("test-cache"));
    command.env("COLUMNS", "100").env("NO_COLOR", "1").env_remove("LATCHWORK_CACHE");
    command.args(args).output().expect("it starts")
}

/// Output, errors and exit code.
fn shown(folder: &Path, args: &[&str]) -> String {
    let Output { status, stdout, stderr } = latchwork(folder, args);
    let text = |bytes| String::from_utf8(bytes).expect("text");
    let code = status.code().expect("an exit code");
    let all = format!("$ latchwork {}\n{}{}[exit code {code}]\n", args.join(" "), text(stdout), text(stderr));
    assert!(!all.contains("panicked"), "{all}");
    without_figures(&all)
}

fn without_figures(text: &str) -> String {
    let mut out = text.to_owned();
    for (pattern, instead) in [
        (r"\d+\.\d s, \d+ executions/s", "TIME, N executions/s"),
        (r"\d+ (ns|us|ms) typical, \d+ (ns|us|ms) at worst", "TIME typical, TIME at worst"),
        (r#""(median-ns|worst-ns)": \d+"#, r#""$1": TIME"#),
        // What is made from the constants in the code differs from compiler to compiler.
        (r"\d+ (executions|restarts|times|random ones)", "N $1"),
        (r"refused \d+", "refused N"),
        (r"sequence \d+ of", "sequence N of"),
        (r#""(executions|restarts|settings-taken|settings-refused)": \d+"#, r#""$1": N"#),
        (r#""hash": "[0-9a-f]+""#, r#""hash": "HASH""#),
        (r#""size": \d+"#, r#""size": SIZE"#),
        (r"\d+ bytes\n", "SIZE bytes\n"),
        (r#""found": "\d+ bytes""#, r#""found": "SIZE bytes""#),
    ] {
        out = regex::Regex::new(pattern).expect("a pattern").replace_all(&out, instead).into_owned();
    }
    out
}

/// A budget that no busy machine misses.
const PATIENT: [&str; 4] = ["--budget", "1s", "--seed", "7"];

#[test]
fn help_teaches() {
    let folder = folder();
    insta::assert_snapshot!("help_fuzz", shown(folder.path(), &["fuzz", "--help"]));
    insta::assert_snapshot!("help_check_block", shown(folder.path(), &["check-block", "--help"]));
}

#[test]
fn what_is_found_is_told_and_written_as_a_test_that_fails() {
    let folder = folder();
    let defect = ["fuzz", "defects.wasm", "--class", "test:defects/forgetful", "--runs", "200"];
    let found = shown(folder.path(), &[&defect[..], &PATIENT].concat());
    let text = std::fs::read_to_string(folder.path().join("defects-fuzz-7.test.toml")).expect("the test file");
    let test = latchwork(folder.path(), &["test", "defects-fuzz-7.test.toml"]);
    assert_eq!(test.status.code(), Some(1));
    insta::assert_snapshot!("fuzz_found", format!("{found}\n=== defects-fuzz-7.test.toml\n{text}"));
    // The same seed finds the same, and nothing is overwritten.
    let again = shown(folder.path(), &[&defect[..], &PATIENT].concat());
    assert_eq!(again, found.replace("fuzz-7.test.toml", "fuzz-7-2.test.toml"));
    let second = std::fs::read_to_string(folder.path().join("defects-fuzz-7-2.test.toml"));
    assert_eq!(second.expect("another test file"), text);
}

#[test]
fn a_test_file_elsewhere_names_the_component_from_there() {
    let folder = folder();
    let tests = folder.path().join("tests");
    std::fs::create_dir(&tests).expect("a folder");
    let out =
        ["fuzz", "defects.wasm", "--class", "test:defects/trap-late", "--runs", "200", "--out", "tests/late.test.toml"];
    assert_eq!(latchwork(folder.path(), &[&out[..], &PATIENT].concat()).status.code(), Some(1));
    let text = std::fs::read_to_string(tests.join("late.test.toml")).expect("the test file");
    assert!(text.starts_with("component = \"../defects.wasm\"\n"), "{text}");
    let test = latchwork(folder.path(), &["test", "tests"]);
    let said = String::from_utf8_lossy(&test.stdout).into_owned();
    assert!(test.status.code() == Some(1) && said.contains("expected none, got trap"), "{said}");
}

#[test]
fn nothing_found_is_exit_code_0_for_people_and_scripts() {
    let folder = folder();
    let block = ["fuzz", "bounds-check.wasm", "--runs", "100"];
    insta::assert_snapshot!("fuzz_fine", shown(folder.path(), &[&block[..], &PATIENT].concat()));
    insta::assert_snapshot!("fuzz_json", shown(folder.path(), &[&block[..], &PATIENT, &["--json"]].concat()));
    let ignored =
        ["fuzz", "defects.wasm", "--class", "test:defects/forgetful", "--ignore", "not-restored", "--runs", "100"];
    assert_eq!(latchwork(folder.path(), &[&ignored[..], &PATIENT].concat()).status.code(), Some(0));
}

#[test]
fn what_would_be_overwritten_or_cannot_be_written_is_refused_before_the_search() {
    let folder = folder();
    std::fs::write(folder.path().join("mine.test.toml"), "mine").expect("a file");
    let fuzz = |out| shown(folder.path(), &["fuzz", "ton.wasm", "--out", out]);
    let test = ["test", "mine.test.toml", "--junit", "./mine.test.toml"];
    // A shell gives the first test's name to `--junit *.test.toml`.
    let watch = ["test", "other.test.toml", "--watch", "--junit", "mine.test.toml"];
    let tests = [shown(folder.path(), &test), shown(folder.path(), &watch)];
    let all = [&[fuzz("mine.test.toml"), fuzz("nowhere/x.test.toml")], &tests[..]].concat();
    assert_eq!(std::fs::read_to_string(folder.path().join("mine.test.toml")).expect("a file"), "mine");
    insta::assert_snapshot!("fuzz_overwrites", all.join("\n"));
}

#[test]
fn a_search_that_is_interrupted_tells_what_it_has_found() {
    let folder = folder();
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.current_dir(folder.path()).env("XDG_CACHE_HOME", target().join("test-cache")).env_remove("LATCHWORK_CACHE");
    command.args([
        "fuzz",
        "defects.wasm",
        "--class",
        "test:defects/forgetful",
        "--for",
        "5min",
        "--out",
        "x.test.toml",
    ]);
    let child = command.args(PATIENT).stdout(std::process::Stdio::piped()).spawn().expect("it starts");
    let pid = rustix::process::Pid::from_child(&child);
    // Before its handler is there it would end at once: it is when the program has read its component.
    let status = format!("/proc/{}/status", child.id());
    let caught = || {
        let status = std::fs::read_to_string(&status).unwrap_or_default();
        let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:")).map(|m| u64::from_str_radix(m.trim(), 16));
        mask.is_some_and(|m| m.is_ok_and(|m| m >> 1 & 1 == 1))
    };
    let begun = std::time::Instant::now();
    while !caught() {
        assert!(begun.elapsed().as_secs() < 60, "it never catches SIGINT");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    std::thread::sleep(std::time::Duration::from_millis(500));
    rustix::process::kill_process(pid, rustix::process::Signal::INT).expect("it runs");
    let output = child.wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.code().is_some(), "it ends by itself, not by the signal: {text}");
    assert!(text.contains(" sequences, "), "{text}");
}

#[test]
fn a_search_ends_when_its_time_is_over() {
    let folder = folder();
    let begun = std::time::Instant::now();
    let args = ["fuzz", "ton.wasm", "--for", "300ms", "--json"];
    let output = latchwork(folder.path(), &[&args[..], &PATIENT].concat());
    assert_eq!(output.status.code(), Some(0));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
    assert!(json["executions"].as_u64().is_some_and(|n| n > 1000), "{json}");
    assert!(begun.elapsed().as_secs() < 60);
}

#[test]
fn wrong_command_lines_and_components() {
    let folder = folder();
    let mut seen = String::new();
    for args in [
        vec!["fuzz"],
        vec!["fuzz", "missing.wasm"],
        vec!["fuzz", "core.wasm"],
        vec!["fuzz", "csv-days.wasm"],
        vec!["fuzz", "defects.wasm"],
        vec!["fuzz", "ton.wasm", "--class", "latchwork:device/tof"],
        vec!["fuzz", "ton.wasm", "--for", "10"],
        vec!["fuzz", "ton.wasm", "--memory", "4MB"],
        vec!["fuzz", "ton.wasm", "--ignore", "traps"],
        vec![
            "fuzz",
            "defects.wasm",
            "--class",
            "test:defects/trap-late",
            "--runs",
            "200",
            "--seed",
            "7",
            "--out",
            "no/such.test.toml",
        ],
    ] {
        seen += &shown(folder.path(), &args);
        seen.push('\n');
    }
    insta::assert_snapshot!("fuzz_wrong", seen);
}

#[test]
fn a_check_says_whether_a_plant_takes_a_block() {
    let folder = folder();
    let mut seen = String::new();
    for args in [
        vec!["check-block", "bounds-check.wasm"],
        vec!["check-block", "ton.wasm", "--runs", "10"],
        vec!["check-block", "defects.wasm", "--class", "test:defects/leak"],
        vec!["check-block", "defects.wasm", "--class", "test:defects/half-refused"],
        vec!["check-block", "ton.wasm", "--memory", "1KiB"],
        vec!["check-block", "ton.wasm", "--json", "--runs", "10"],
        vec!["check-block", "core.wasm"],
        vec!["check-block", "csv-days.wasm"],
        vec!["check-block", "csv-days.wasm", "--json"],
        vec!["check-block", "missing.wasm"],
    ] {
        seen += &shown(folder.path(), &[&args[..], &PATIENT].concat());
        seen.push('\n');
    }
    insta::assert_snapshot!("check_block", seen);
}

#[test]
fn reservations_are_a_verdict_of_their_own_which_scripts_may_take_for_a_refusal() {
    let folder = folder();
    let check = |class: &str, more: &[&str]| {
        let class = format!("test:defects/{class}");
        let args = ["check-block", "defects.wasm", "--class", &class, "--runs", "100"];
        let output = latchwork(folder.path(), &[&args[..], &PATIENT, &["--json"], more].concat());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
        let class = &json["classes"][0];
        assert_eq!(json["verdict"], class["verdict"]);
        let reservations = class["reservations"].as_array().map(Vec::len);
        (output.status.code(), json["ok"].clone(), json["verdict"].clone(), reservations)
    };
    let verdict = "accepted-with-reservations".into();
    assert_eq!(check("half-refused", &[]), (Some(0), true.into(), verdict, Some(1)));
    for disturbed in ["half-refused", "save-resets"] {
        assert_eq!(check(disturbed, &["--strict"]).0, Some(1), "{disturbed}");
    }
    // To begin anew after a restart may be meant.
    assert_eq!(check("forgetful", &["--strict"]), (Some(0), true.into(), "accepted".into(), Some(0)));
    assert_eq!(check("trap-above", &[]), (Some(1), false.into(), "refused".into(), Some(0)));
}
