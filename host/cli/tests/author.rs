//! `latchwork new` and `latchwork build` as a user meets them: help, exit codes, silence with flags.

use std::path::Path;
use std::process::{Command, Output, Stdio};
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
    for args in [
        vec!["new"],
        vec!["new", "pump"],
        vec!["new", "pump", "--lang", "zig"],
        vec!["new", "pump", "--lang", "rusty", "--class", "motor"],
        vec!["build"],
        vec!["build", "nowhere"],
    ] {
        let output = latchwork(folder.path(), &args);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{args:?}: {text}");
        seen += &format!("$ latchwork {}\n{text}\n", args.join(" "));
    }
    insta::assert_snapshot!("new_and_build_without_what_they_need", seen);
}
