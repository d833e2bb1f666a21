//! `latchwork replay` as a user meets it: a plant that records, a replay, another component, a test of what happened.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

fn latchwork(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    let cache = target().join("test-cache");
    command.current_dir(folder).env("XDG_CACHE_HOME", cache).env("COLUMNS", "100").env("NO_COLOR", "1");
    command.env_remove("LATCHWORK_CACHE").args(args).output().expect("latchwork starts")
}

fn target() -> PathBuf {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    exe.ancestors().nth(2).expect("the binary stands in target/release").to_path_buf()
}

fn text(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("text") + &String::from_utf8(output.stderr.clone()).expect("text")
}

/// A folder in which a plant has run for five seconds, recorded.
fn night() -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    let components = target().join("components");
    assert!(components.is_dir(), "{} is missing: run `cargo xtask guests` first", components.display());
    let plant = format!(
        r#"[plant]
name = "stairs"
components = [{:?}]
[recorder]
blocks = ["light", "presses"]
keyframe = "1s"
[lane.main]
every = "10ms"
[driver.hall]
kind = "sim"
[driver.hall.points]
button = {{ type = "bool" }}
[block.light]
component = "tof"
lane = "main"
inputs.in = "hall.button"
inputs.pt = "2s"
[block.presses]
component = "ctu"
lane = "main"
inputs.cu = "hall.button"
inputs.pv = 3
"#,
        components.display().to_string()
    );
    std::fs::write(folder.path().join("stairs.toml"), plant).expect("the plant file");
    std::fs::write(folder.path().join("push.csv"), "time,tag,value\n1s,hall.button,true\n1.2s,hall.button,false\n")
        .expect("the stimulus");
    let args =
        ["run", "stairs.toml", "--speed", "max", "--for", "5s", "--stimulus", "push.csv", "--data", "data", "-q"];
    let ran = latchwork(folder.path(), &args);
    assert_eq!(ran.status.code(), Some(0), "{}", text(&ran));
    folder
}

#[test]
fn help_teaches() {
    let folder = TempDir::new().expect("a temporary folder");
    let output = latchwork(folder.path(), &["replay", "--help"]);
    assert_eq!(output.status.code(), Some(0));
    insta::assert_snapshot!("help_replay", text(&output));
}

#[test]
fn a_replay_says_that_the_outputs_are_equal_and_exits_0() {
    let folder = night();
    let output = latchwork(folder.path(), &["replay", "data/recorder"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    insta::assert_snapshot!("replay_equal", text(&output));
    let part = latchwork(folder.path(), &["replay", "data/recorder", "--block", "light", "--from", "3s", "--to", "4s"]);
    assert_eq!(part.status.code(), Some(0), "{}", text(&part));
    assert!(text(&part).contains("3s to 4s\n  equal bit for bit: 101 executions"), "{}", text(&part));
}

#[test]
fn a_replay_as_json_has_both_hashes() {
    let folder = night();
    let output = latchwork(folder.path(), &["replay", "data/recorder", "--block", "presses", "--json"]);
    let reports: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(reports[0]["block"], "presses");
    assert_eq!(reports[0]["recorded"], reports[0]["replayed"]);
    assert_eq!(reports[0]["recorded"].as_str().map(str::len), Some(64));
    assert_eq!(reports[0]["executions"], 500);
}

#[test]
fn what_is_wrong_is_said_with_the_way_out() {
    let folder = night();
    let components = target().join("components");
    let ton = components.join("ton.wasm").display().to_string();
    let cases: Vec<(Vec<&str>, i32, &str)> = vec![
        (vec!["replay", "stairs.toml"], 1, "is no recording"),
        (vec!["replay", "nowhere"], 1, "nowhere: No such file"),
        (vec!["replay", "data/recorder", "--block", "lihgt"], 1, "it has `light`, `presses`"),
        (vec!["replay", "data/recorder", "--run", "7"], 1, "the recording has no run 7; it has 1"),
        (vec!["replay", "data/recorder", "--with", &ton], 2, "--block"),
        (vec!["replay", "data/recorder", "--block", "light", "--with", &ton], 1, "latchwork:device/tof"),
        (vec!["replay", "data/recorder", "--from", "yesterday"], 2, "expected plant time"),
        (
            vec!["replay", "data/recorder", "--block", "light", "--with", &ton, "--tolerance", "x"],
            2,
            "expected TAG=NUMBER",
        ),
    ];
    for (args, code, sentence) in cases {
        let output = latchwork(folder.path(), &args);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {}", text(&output));
        assert!(text(&output).contains(sentence), "{args:?}: {}", text(&output));
    }
}

#[test]
fn recorded_time_is_written_as_a_component_test_with_its_component_beside_it() {
    let folder = night();
    let args = ["replay", "data/recorder", "--block", "light", "--export", "light.test.toml"];
    let output = latchwork(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    assert!(folder.path().join("tof.wasm").is_file());
    let test = std::fs::read_to_string(folder.path().join("light.test.toml")).expect("the test");
    let test = test.split_once('\n').map_or("", |(_, rest)| rest);
    insta::assert_snapshot!("exported", test);
    // What somebody has made of it stays.
    std::fs::write(folder.path().join("light.test.toml"), "mended").expect("the test");
    let output = latchwork(folder.path(), &args);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output));
    assert!(text(&output).contains("light.test.toml exists and stays as it is"), "{}", text(&output));
    let stays = std::fs::read_to_string(folder.path().join("light.test.toml")).expect("the test");
    assert_eq!(stays, "mended");
}

/// Fenced blocks of a page: language and text.
fn fenced(page: &str) -> Vec<(&str, &str)> {
    let mut blocks = Vec::new();
    let mut rest = page;
    while let Some((_, after)) = rest.split_once("```") {
        let (language, after) = after.split_once('\n').expect("a line");
        let (text, after) = after.split_once("```").expect("the end of a block");
        blocks.push((language, text));
        rest = after;
    }
    blocks
}

/// Output without what is another time each time: how long the tests took.
fn timeless(output: &str) -> String {
    let cut = |line: &str| match line.split_once(" in ") {
        Some((before, after)) if after.ends_with("steps/s") => format!("{before}\n"),
        _ => format!("{line}\n"),
    };
    output.lines().map(cut).collect()
}

/// Runs what a page shows and compares what it says: `toml` is the plant file, and behind it what stands in `night.test.toml`,
/// which a `diff` changes; `csv` the stimulus; `console` commands with their output.
fn shows_what_happens(name: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name);
    let page = std::fs::read_to_string(&path).expect("the page");
    let folder = TempDir::new().expect("a temporary folder");
    std::os::unix::fs::symlink(target(), folder.path().join("target")).expect("a link");
    let (plant, test) = (folder.path().join("plant.toml"), folder.path().join("night.test.toml"));
    let mut made = page.clone();
    for (language, block) in fenced(&page) {
        match language {
            "toml" if !plant.exists() => std::fs::write(&plant, block).expect("the plant file"),
            "toml" => {
                let exported = std::fs::read_to_string(&test).expect("a test was exported");
                assert!(exported.contains(block), "{name} shows what is not in the test:\n{block}\n{exported}");
            }
            "diff" => {
                let exported = std::fs::read_to_string(&test).expect("a test was exported");
                let lines = |sign| block.lines().filter_map(|l| l.strip_prefix(sign)).collect::<Vec<_>>().join("\n");
                assert!(exported.contains(&lines('-')), "{name} changes what is not in the test:\n{block}\n{exported}");
                std::fs::write(&test, exported.replace(&lines('-'), &lines('+'))).expect("the test can be written");
            }
            "csv" => std::fs::write(folder.path().join("stimulus.csv"), block).expect("the stimulus"),
            "console" => {
                let mut shown = String::new();
                for command in block.lines().filter_map(|l| l.strip_prefix("$ ")) {
                    let words: Vec<_> = command.split_whitespace().collect();
                    shown += &format!("$ {command}\n");
                    match &words[..] {
                        ["latchwork", args @ ..] => shown += &timeless(&text(&latchwork(folder.path(), args))),
                        ["cp", from, to] => {
                            std::fs::copy(folder.path().join(from), folder.path().join(to)).expect("a copy");
                        }
                        _ => panic!("{name}: `{command}` is not run"),
                    }
                }
                made = made.replace(&format!("```console\n{block}```"), &format!("```console\n{shown}```"));
            }
            _ => {}
        }
    }
    if std::env::var_os("LATCHWORK_BLESS").is_some() {
        std::fs::write(&path, &made).expect("the page can be written");
    }
    assert_eq!(made, page, "run with LATCHWORK_BLESS=1 to write the page anew");
}

#[test]
fn the_page_of_the_flight_recorder_shows_what_happens() {
    shows_what_happens("flight-recorder.md");
}

#[test]
fn the_page_of_incidents_shows_what_happens() {
    shows_what_happens("from-an-incident-to-a-test.md");
}
