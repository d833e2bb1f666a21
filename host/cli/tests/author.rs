//! `latchwork new` and `latchwork build` as a user meets them: help, exit codes, silence with flags.

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};
use tempfile::TempDir;

fn latchwork(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.current_dir(folder).env("COLUMNS", "100").env("NO_COLOR", "1").stdin(Stdio::null());
    command.args(args).output().expect("latchwork starts")
}

#[test]
fn help_teaches() {
    let folder = TempDir::new().expect("a folder");
    for (name, args) in [("help_new", ["new", "--help"]), ("help_build", ["build", "--help"])] {
        let output = latchwork(folder.path(), &args);
        assert_eq!(output.status.code(), Some(0));
        insta::assert_snapshot!(name, String::from_utf8_lossy(&output.stdout));
    }
}

#[test]
fn new_with_flags_asks_nothing_and_says_what_comes_next() {
    let folder = TempDir::new().expect("a folder");
    let output = latchwork(folder.path(), &["new", "feed-pump", "--lang", "c", "--class", "motor"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty());
    assert!(folder.path().join("feed-pump/block.c").is_file());
    insta::assert_snapshot!("new_feed_pump", String::from_utf8_lossy(&output.stdout));
}

#[test]
fn without_a_terminal_what_is_missing_is_an_error() {
    let folder = TempDir::new().expect("a folder");
    let mut seen = String::new();
    for (code, args) in [
        (2, vec!["new"]),
        (2, vec!["new", "pump"]),
        (2, vec!["new", "pump", "--lang", "zig"]),
        (2, vec!["new", "pump", "--lang", "rusty", "--class", "motor"]),
        (2, vec!["new", "Pump"]),
        (1, vec!["new", "pump", "--lang", "c", "--wit", "nope"]),
        (1, vec!["build"]),
        (1, vec!["build", "nowhere"]),
    ] {
        let output = latchwork(folder.path(), &args);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {text}");
        seen += &format!("$ latchwork {}\n{text}\n", args.join(" "));
    }
    insta::assert_snapshot!("new_and_build_without_what_they_need", seen);
}

#[test]
fn a_missing_tool_is_named_in_every_language_with_the_way_to_get_it() {
    let folder = TempDir::new().expect("a folder");
    std::fs::create_dir(folder.path().join("empty")).expect("a folder");
    let mut seen = String::new();
    for language in ["rust", "c", "cpp", "python", "javascript", "typescript", "go", "zig", "assemblyscript"] {
        let name = format!("pump-{language}");
        let made = latchwork(folder.path(), &["new", &name, "--lang", language, "--class", "motor"]);
        assert_eq!(made.status.code(), Some(0), "{}", String::from_utf8_lossy(&made.stderr));
        let mut build = Command::new(env!("CARGO_BIN_EXE_latchwork"));
        build.current_dir(folder.path()).env("PATH", folder.path().join("empty")).env("NO_COLOR", "1");
        let output = build.args(["build", &name]).stdin(Stdio::null()).output().expect("latchwork starts");
        assert_eq!(output.status.code(), Some(1), "{language}");
        assert!(output.stdout.is_empty(), "{language}");
        seen += &format!("$ latchwork build {name}\n{}\n", String::from_utf8_lossy(&output.stderr));
    }
    insta::assert_snapshot!("build_without_tools", seen);
}

/// Longest that a question takes to come on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs `latchwork` on a terminal of its own, and answers each question with keys; what the terminal showed.
fn at_a_terminal(folder: &Path, line: &str, answers: &[(&str, &str)]) -> String {
    let mut child = Command::new("script")
        .args(["--quiet", "--return", "--command", &format!("{} {line}", env!("CARGO_BIN_EXE_latchwork")), "/dev/null"])
        .current_dir(folder)
        .env("TERM", "xterm")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("`script` of util-linux starts");
    let mut keys = child.stdin.take().expect("its input");
    let mut out = child.stdout.take().expect("its output");
    let (bytes, seen) = mpsc::channel();
    let reading = std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(n @ 1..) = out.read(&mut buffer) {
            // Whoever asked may have had enough.
            let _ = bytes.send(buffer[..n].to_vec());
        }
    });
    let (mut shown, mut from) = (Vec::new(), 0);
    for (question, answer) in answers {
        let end = Instant::now() + PATIENCE;
        while !String::from_utf8_lossy(&shown[from..]).contains(question) {
            let more = seen.recv_timeout(end.saturating_duration_since(Instant::now()));
            shown.extend(more.unwrap_or_else(|_| panic!("no {question:?} in {}", String::from_utf8_lossy(&shown))));
        }
        from = shown.len();
        keys.write_all(answer.as_bytes()).expect("the keys are taken");
    }
    let end = Instant::now() + PATIENCE;
    let ended = loop {
        match seen.recv_timeout(end.saturating_duration_since(Instant::now())) {
            Ok(more) => shown.extend(more),
            Err(why) => break why == RecvTimeoutError::Disconnected,
        }
    };
    if !ended {
        let _ = child.kill();
    }
    let shown = String::from_utf8_lossy(&shown).into_owned();
    let status = child.wait().expect("its end");
    reading.join().expect("it ends with the terminal");
    assert!(status.success(), "{status}: {shown}");
    shown
}

#[test]
fn on_a_terminal_new_asks_for_what_is_missing_and_for_nothing_else() {
    const DOWN: &str = "\u{1b}[B";
    let folder = TempDir::new().expect("a folder");
    let all = [("Name of the block", "feed-pump\r"), ("Language", &format!("{DOWN}\r")), ("Device class", "\r")];
    let shown = at_a_terminal(folder.path(), "new", &all);
    assert!(shown.contains("latchwork build feed-pump"), "{shown}");
    let read = |file: &str| std::fs::read_to_string(folder.path().join(file)).expect("a project");
    let (manifest, world) = (read("feed-pump/block.toml"), read("feed-pump/wit/world.wit"));
    assert!(
        manifest.contains("lang = \"c\"") && world.contains("export latchwork:device/alarm-unit@"),
        "{manifest}{world}"
    );

    let shown = at_a_terminal(folder.path(), "new drain --class motor", &[("Language", "\r")]);
    assert!(!shown.contains("Device class") && !shown.contains("Name of"), "{shown}");
    let (manifest, world) = (read("drain/block.toml"), read("drain/wit/world.wit"));
    assert!(
        manifest.contains("lang = \"rust\"") && world.contains("export latchwork:device/motor@"),
        "{manifest}{world}"
    );

    let shown = at_a_terminal(folder.path(), "new fan --lang zig --class motor", &[]);
    assert!(!shown.contains("Language") && folder.path().join("fan/block.zig").is_file(), "{shown}");
}
