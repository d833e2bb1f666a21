//! `latchwork gpio` where there is no such chip, and its help.

use std::process::{Command, Output};

fn gpio(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.arg("gpio").args(args).env("COLUMNS", "100").env("NO_COLOR", "1");
    command.output().expect("latchwork starts")
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("text")
}

#[test]
fn help_teaches() {
    let output = gpio(&["--help"]);
    assert!(output.status.success());
    insta::assert_snapshot!("help_gpio", text(&output.stdout));
}

#[test]
fn a_chip_that_is_not_there_is_told_with_those_that_are() {
    let output = gpio(&["--chip", "/dev/gpiochip4711"]);
    assert_eq!(output.status.code(), Some(1));
    let told = text(&output.stderr);
    assert!(told.starts_with("error: /dev/gpiochip4711 is not there; "), "{told}");
    assert!(
        told.contains("the chips here are /dev/gpiochip") || told.contains("has no GPIO character device"),
        "{told}"
    );
}

#[test]
fn json_is_a_list_whatever_is_found() {
    for args in [&["--json"][..], &["--json", "--chip", "no-such-label"]] {
        let output = gpio(args);
        let list: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let chips = list.as_array().expect("a list");
        // Without a chip there is a sentence that says what to do.
        assert!(!chips.is_empty() || output.status.code() == Some(1) && !output.stderr.is_empty(), "{output:?}");
    }
}
