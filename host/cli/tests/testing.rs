//! `latchwork test` as a user meets it. What differs from run to run, its times, is left out.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use tempfile::TempDir;

const TIMER: &str = r#"component = "ton"
every = "10ms"
inputs = { pt = "30ms" }

[[case]]
name = "the output follows after the time"
[[case.step]]
at = "0ms"
inputs = { in = true }
expect = { outputs = { q = false } }
[[case.step]]
at = "30ms"
expect = { outputs = { q = true, et = "30ms" } }
"#;

const WRONG: &str = r#"
[[case]]
name = "the output comes too early <&>"
step = [{ inputs = { in = true } }, { at = "20ms", expect = { outputs = { q = true } } }]
"#;

fn target() -> PathBuf {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    exe.ancestors().nth(2).expect("the binary stands in target/release").to_path_buf()
}

/// A folder with test files.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().expect("a temporary folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
    folder
}

fn latchwork(folder: &Path, args: &[&str]) -> Command {
    let components = target().join("components");
    assert!(components.is_dir(), "{} is missing: run `cargo xtask guests` first", components.display());
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.current_dir(folder).env("XDG_CACHE_HOME", target().join("test-cache"));
    command.env("COLUMNS", "100").env("NO_COLOR", "1").env_remove("LATCHWORK_CACHE");
    command.args(args);
    if args.first() == Some(&"test") {
        command.arg("--components").arg(components);
    }
    command
}

/// Output, errors and exit code, without times and the build folder.
fn shown(folder: &Path, args: &[&str]) -> String {
    let Output { status, stdout, stderr } = latchwork(folder, args).output().expect("it starts");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    let code = status.code().expect("an exit code");
    let all = format!("$ latchwork {}\n{}{}[exit code {code}]\n", args.join(" "), text(stdout), text(stderr));
    without_times(&all)
}

fn without_times(text: &str) -> String {
    let mut out = text.replace(&target().display().to_string(), "TARGET");
    for (pattern, instead) in [
        (r"in (\d+ ms|\d+\.\d s): ", "in TIME: "),
        (r"\d+ steps/s", "N steps/s"),
        (r#"time="\d+\.\d+""#, r#"time="TIME""#),
        (r#""took-ns": \d+"#, r#""took-ns": TIME"#),
        (r#""hash": "[0-9a-f]+""#, r#""hash": "HASH""#),
    ] {
        out = regex::Regex::new(pattern).expect("a pattern").replace_all(&out, instead).into_owned();
    }
    out
}

#[test]
fn help_of_test() {
    let folder = folder(&[]);
    insta::assert_snapshot!("help_test", shown(folder.path(), &["test", "--help"]));
}

#[test]
fn what_passes_what_fails_and_what_is_wrong_with_their_exit_codes() {
    let both = format!("{TIMER}{WRONG}");
    let broken = TIMER.replace("outputs = { q = true", "outputs = { p = true");
    let folder = folder(&[
        ("ton.test.toml", TIMER),
        ("more/both.test.toml", &both),
        ("more/target/not-this.test.toml", ""),
        ("wrong/broken.test.toml", &broken),
        ("empty/readme.md", ""),
    ]);
    let mut seen = String::new();
    for args in [
        &["test", "ton.test.toml"][..],
        &["test", "ton.test.toml", "more"],
        &["test", "more", "--filter", "follows"],
        &["test", "wrong/broken.test.toml", "ton.test.toml"],
        &["test", "missing.test.toml"],
        &["test", "empty"],
        &["test", "more", "--filter", "no such case"],
        &["test", "ton.test.toml", "--watch", "--json"],
        &["test", "ton.test.toml", "--junit", "no/such/folder.xml"],
    ] {
        seen += &format!("{}\n", shown(folder.path(), args));
    }
    insta::assert_snapshot!("test_outputs", seen);
}

#[test]
fn json_and_junit_tell_the_same() {
    let both = format!("{TIMER}{WRONG}");
    let broken = TIMER.replace("outputs = { q = true", "outputs = { p = true");
    let folder = folder(&[("both.test.toml", &both), ("broken.test.toml", &broken)]);
    let args = ["test", "both.test.toml", "broken.test.toml", "--json", "--junit", "report.xml"];
    insta::assert_snapshot!("test_json", shown(folder.path(), &args));
    let xml = std::fs::read_to_string(folder.path().join("report.xml")).expect("the report");
    insta::assert_snapshot!("test_junit", without_times(&xml));
}

#[test]
fn a_component_that_does_not_fit_the_test() {
    let cases = "[[case]]\nname = \"c\"\n[[case.step]]\n";
    let of = |head: &str, step: &str| format!("{head}\n{cases}{step}\n");
    let folder = folder(&[
        ("no-such.test.toml", &of("component = \"tonn\"", "")),
        ("no-file.test.toml", &of("component = \"ton.wasm\"", "")),
        ("no-component.test.toml", &of("component = \"notes.wasm\"", "")),
        ("notes.wasm", "The block is yet to be built.\n"),
        ("core.test.toml", &of("component = \"core.wasm\"", "")),
        ("core.wasm", "\0asm\x01\0\0\0"),
        ("other-class.test.toml", &of("component = \"ton\"\nclass = \"latchwork:device/alarm-unit\"", "")),
        ("several-classes.test.toml", &of("component = \"two-classes\"", "")),
        ("no-block.test.toml", &of("component = \"csv-days\"", "")),
        (
            "other-ports.test.toml",
            &of(
                "component = \"ton\"\nsettings = { pulse = \"1s\" }",
                "inputs = { level = 5 }\ncommands = [\"reset\"]\nexpect = { outputs = { lamp = true }, alarms = [\"door\"], state = { starts = 1 } }",
            ),
        ),
        (
            "other-columns.test.toml",
            &of(
                "component = \"ton\"",
                "[[case.table]]\ncolumns = [\"inputs.level\", \"inputs.in.quality\", \"outputs.lamp\"]\nrows = []",
            ),
        ),
        ("other-version.test.toml", &of("component = \"ton\"", "swap = \"ctu\"")),
    ]);
    let mut seen = String::new();
    let parts = target().join("test-components").display().to_string();
    for name in [
        "no-such",
        "no-file",
        "no-component",
        "core",
        "other-class",
        "several-classes",
        "no-block",
        "other-ports",
        "other-columns",
        "other-version",
    ] {
        let file = format!("{name}.test.toml");
        seen += &format!("{}\n", shown(folder.path(), &["test", &file, "--components", &parts]));
    }
    insta::assert_snapshot!("test_components_that_do_not_fit", seen);
}

#[test]
fn the_blocks_of_a_plant_are_looked_for_in_the_folders_of_the_command_line_first() {
    let plant = "[plant]\nname = \"hall\"\n[lane.main]\nevery = \"10ms\"\n\
                 [driver.field]\nkind = \"sim\"\n[driver.field.points]\nin = { type = \"bool\" }\n\
                 [block.late]\ncomponent = \"NAME\"\nlane = \"main\"\ninputs.in = \"field.in\"\ninputs.pt = \"30ms\"\n";
    let test = "plant = \"FILE\"\n[[case]]\nname = \"the output follows after the time\"\ninputs = { field.in = true }\nstep = [\n\
                { at = \"20ms\", expect = { outputs = { late.outputs.q = false } } },\n\
                { at = \"30ms\", expect = { outputs = { late.outputs.q = true } } },\n]\n";
    // A pulse where an on-delay is meant stands in the plant's own folder.
    let own = plant.replace("name = \"hall\"", "name = \"hall\"\ncomponents = [\"own\"]").replace("NAME", "timer");
    let folder = folder(&[
        ("hall.toml", &plant.replace("NAME", "ton")),
        ("hall.test.toml", &test.replace("FILE", "hall.toml")),
        ("own.toml", &own),
        ("own.test.toml", &test.replace("FILE", "own.toml")),
        ("own/readme.md", ""),
        ("new/readme.md", ""),
    ]);
    for (from, to) in [("tp.wasm", "own/timer.wasm"), ("ton.wasm", "new/timer.wasm")] {
        std::fs::copy(target().join("components").join(from), folder.path().join(to)).expect("a component");
    }
    let passed = |args: &[&str]| latchwork(folder.path(), args).output().expect("it starts").status.success();
    assert!(passed(&["test", "hall.test.toml"]), "{}", shown(folder.path(), &["test", "hall.test.toml"]));
    assert!(!passed(&["test", "own.test.toml"]), "the pulse in the plant's own folder passes");
    let args = ["test", "own.test.toml", "--components", "new"];
    assert!(passed(&args), "{}", shown(folder.path(), &args));
}

#[test]
fn control_characters_reach_neither_the_terminal_nor_the_report() {
    let text = r#"component = "ton"
[[case]]
name = "\u001b[2Jred\u009b31m"
step = [
    { name = "beep\u0007", expect = { outputs = { q = true } } },
    { at = "20ms", settings = {}, expect = { outputs = { q = false } } },
]
[[case]]
name = "fine\r"
table = "rows.csv"
"#;
    let wrong = "component = \"ton\"\n[[case]]\nname = \"\\u001b[2J\"\nstep = [{}]\n[[case]]\nname = \"\\u001b[2J\"\nstep = [{}]\n";
    let rows = "name,inputs.in,outputs.q\na\u{1b}[1m,TRUE,FALSE\n";
    let folder = folder(&[("c.test.toml", text), ("wrong.test.toml", wrong), ("rows.csv", rows)]);
    let seen = shown(folder.path(), &["test", "c.test.toml", "wrong.test.toml", "--junit", "report.xml"]);
    assert!(!seen.contains(|c: char| c.is_control() && c != '\n'), "{seen:?}");
    let xml = std::fs::read_to_string(folder.path().join("report.xml")).expect("the report");
    assert!(!xml.contains(|c: char| c.is_control() && c != '\n'), "{xml:?}");
    let mut reader = quick_xml::Reader::from_str(&xml);
    let mut names = Vec::new();
    loop {
        match reader.read_event().expect("valid XML") {
            quick_xml::events::Event::Eof => break,
            quick_xml::events::Event::Start(e) | quick_xml::events::Event::Empty(e)
                if e.name().as_ref() == b"testcase" =>
            {
                let name = e.try_get_attribute("name").expect("attributes").expect("a name");
                names.push(String::from_utf8_lossy(&name.value).into_owned());
            }
            _ => {}
        }
    }
    assert_eq!(names, ["\\u{1b}[2Jred\\u{9b}31m", "fine\\r", "the test file"]);
    insta::assert_snapshot!("test_control_characters", seen);
}

/// A child that is ended with the test.
struct Watching(Child);

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The next line that holds a text, within a minute.
fn wait_for(lines: &Receiver<String>, text: &str) -> String {
    loop {
        let line = lines.recv_timeout(Duration::from_secs(60)).unwrap_or_else(|e| panic!("no `{text}`: {e}"));
        if line.contains(text) {
            return line;
        }
    }
}

#[test]
fn watch_tests_again_when_the_file_or_its_component_changes() {
    let folder = folder(&[("parts/readme.md", "")]);
    let file = folder.path().join("timer.test.toml");
    std::fs::write(&file, format!("components = [\"parts\"]\n{}", TIMER.replace("\"ton\"", "\"timer\"")))
        .expect("a file");
    let mut command = latchwork(folder.path(), &["test", "timer.test.toml", "--watch"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it starts");
    let mut child = Watching(child);
    let out = child.0.stdout.take().expect("its output");
    let (sender, lines) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(out).lines().map_while(Result::ok) {
            let _ = sender.send(line);
        }
    });
    // Nothing is there yet.
    wait_for(&lines, "1 file not tested");
    wait_for(&lines, "waiting for a change");
    let component = folder.path().join("parts/timer.wasm");
    let put = |name: &str| {
        let draft = component.with_extension("new");
        std::fs::copy(target().join("components").join(name), &draft).expect("a component");
        std::fs::rename(&draft, &component).expect("a component");
    };
    put("ton.wasm");
    assert!(wait_for(&lines, "passed").starts_with("1 passed, 0 failed"));
    wait_for(&lines, "waiting for a change");
    // A pulse comes at once, an on-delay after its time.
    put("tp.wasm");
    assert!(wait_for(&lines, "passed").starts_with("0 passed, 1 failed"));
    wait_for(&lines, "waiting for a change");
    let text = std::fs::read_to_string(&file)
        .expect("the file")
        .replace("q = false", "q = true")
        .replace("q = true, et", "q = false, et");
    std::fs::write(&file, text).expect("the file");
    assert!(wait_for(&lines, "passed").starts_with("1 passed, 0 failed"));
}

/// The text of the n-th fenced block of a language, from 0.
fn fenced<'a>(page: &'a str, language: &str, n: usize) -> &'a str {
    let fence = format!("```{language}\n");
    let start = page.match_indices(&fence).nth(n).unwrap_or_else(|| panic!("no {language} block {n}")).0 + fence.len();
    let length = page[start..].find("```").expect("the end of the block");
    &page[start..start + length]
}

#[test]
fn the_page_on_testing_shows_what_comes_out() {
    let page = include_str!("../../../docs/testing-a-block.md");
    let first = fenced(page, "toml", 0);
    let too_early = first.replace("outputs = { q = false, et = \"40ms\" }", "outputs = { q = true, et = \"40ms\" }");
    let misspelt =
        first.replace("at = \"40ms\"", "at = \"40\"").replace("outputs = { q = true }", "outputs = { qq = true }");
    for (n, text) in [first, &too_early, &misspelt].into_iter().enumerate() {
        let folder = folder(&[("ton.test.toml", text)]);
        let output = latchwork(folder.path(), &["test", "ton.test.toml"]).output().expect("it starts");
        assert_eq!(output.status.code(), Some(i32::from(n > 0)));
        let out = without_times(&String::from_utf8(output.stdout).expect("text"));
        assert_eq!(out, without_times(fenced(page, "text", n)), "output {n} of the page");
    }
    let with_csv = String::from("component = \"bounds-check\"\n[[case]]\nname = \"c\"\ntable = \"bounds.csv\"\n");
    for (text, blocks) in [
        (fenced(page, "toml", 1), "components"),
        (fenced(page, "toml", 2), "components"),
        (fenced(page, "toml", 3), "example-components"),
        (&with_csv, "components"),
    ] {
        let folder = folder(&[("x.test.toml", text), ("bounds.csv", fenced(page, "csv", 0))]);
        let mut command = latchwork(folder.path(), &["test", "x.test.toml"]);
        let output = command.arg("--components").arg(target().join(blocks)).output().expect("it starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    }
}
