//! Retained state of a plant in a process of its own: over stops, over kills, in `status` and in the summary.

use latchwork_retain::{FILES, Found, read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longer than anything here takes on a busy machine; a wait that long is a failure.
const LONG: Duration = Duration::from_secs(60);
const KILLS: u64 = 200;

/// Two counters that count every scan and whose state is two equal numbers.
fn plant(every: &str) -> TempDir {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    let target = exe.ancestors().nth(2).expect("the binary stands in target/release");
    let components = target.join("test-components");
    assert!(components.is_dir(), "{} is missing: run `cargo xtask guests` first", components.display());
    let text = format!(
        "[plant]\nname = \"kept\"\ncomponents = [{:?}]\n[retain]\nevery = \"{every}\"\n\
         [lane.main]\nevery = \"1ms\"\nwatchdog = \"20s\"\n\
         [block.a]\ncomponent = \"keeper-probe\"\nlane = \"main\"\nbudget = \"5s\"\nretain = true\ninputs.count = true\n\
         [block.b]\ncomponent = \"keeper-probe\"\nlane = \"main\"\nbudget = \"5s\"\nretain = true\ninputs.count = true\n",
        components.display().to_string()
    );
    let folder = TempDir::new().expect("a folder");
    std::fs::write(folder.path().join("plant.toml"), text).expect("the plant file");
    folder
}

fn latchwork(folder: &Path) -> Command {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    let cache: PathBuf = exe.ancestors().nth(2).expect("target").join("test-cache");
    let mut command = Command::new(exe);
    command.current_dir(folder).env("LATCHWORK_CACHE", cache);
    command.args(["run", "plant.toml", "--quiet", "--data", "data"]);
    command
}

/// A run at virtual time to its end; the first value of a tag, and the summary.
fn run(folder: &Path, duration: &str) -> (String, serde_json::Value) {
    let output = latchwork(folder)
        .args([
            "--speed",
            "max",
            "--for",
            duration,
            "--json",
            "--trace",
            "trace.csv",
            "--trace-tags",
            "a.outputs.count",
        ])
        .output()
        .expect("it starts");
    assert!(output.status.success(), "{}", errors(&output));
    let trace = std::fs::read_to_string(folder.join("trace.csv")).expect("a trace");
    let first = trace.lines().nth(1).expect("a row").split(',').next_back().expect("a value").to_owned();
    (first, serde_json::from_slice(&output.stdout).expect("JSON"))
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn count(found: &Found, block: &str) -> u64 {
    found.retained.blocks.get(block).map_or(0, |saved| saved.cells[0])
}

#[test]
fn a_counter_outlives_the_process_and_the_summary_says_what_was_written() {
    let folder = plant("1s");
    let (first, summary) = run(folder.path(), "5500ms");
    assert_eq!(first, "1");
    let retained = &summary["retained"];
    assert_eq!((&retained["blocks"], &retained["every-ns"]), (&2.into(), &1_000_000_000u64.into()));
    assert_eq!(retained["rounds"], 5);
    // At virtual time rounds may come faster than the disk takes them: then the newer one counts.
    let (writes, bytes) =
        (retained["writes"].as_u64().expect("a number"), retained["bytes"].as_u64().expect("a number"));
    assert!((1..=6).contains(&writes) && bytes == writes * 4096, "{retained}");
    let (first, _) = run(folder.path(), "1s");
    assert_eq!(first, "5501");
    assert_eq!(count(&read(&folder.path().join("data")), "a"), 6500);
}

#[test]
fn a_damaged_folder_starts_and_says_so() {
    let folder = plant("1s");
    run(folder.path(), "100ms");
    for name in FILES {
        let path = folder.path().join("data").join(name);
        let mut bytes = std::fs::read(&path).expect("a file");
        bytes.iter_mut().for_each(|b| *b = b.wrapping_add(1));
        std::fs::write(&path, bytes).expect("damage");
    }
    let output = latchwork(folder.path())
        .args(["--speed", "max", "--for", "100ms", "--records", "records.jsonl"])
        .output()
        .expect("it starts");
    assert!(output.status.success(), "{}", errors(&output));
    let records = std::fs::read_to_string(folder.path().join("records.jsonl")).expect("records");
    assert!(records.contains("not-restored") && records.contains("retained-0.damaged"), "{records}");
    assert_eq!(count(&read(&folder.path().join("data")), "a"), 100, "it has begun anew");
}

#[test]
fn without_a_folder_a_note_says_what_is_lost() {
    let folder = plant("1s");
    let exe = env!("CARGO_BIN_EXE_latchwork");
    let output = Command::new(exe)
        .current_dir(folder.path())
        .args(["run", "plant.toml", "--quiet", "--speed", "max", "--for", "100ms"])
        .output()
        .expect("it starts");
    assert!(output.status.success());
    let told = errors(&output);
    assert!(told.contains("`a`, `b` does not outlive this run") && told.contains("--data FOLDER"), "{told}");
}

#[test]
fn a_plant_that_retains_nothing_makes_no_files() {
    let folder = plant("1s");
    let path = folder.path().join("plant.toml");
    let text = std::fs::read_to_string(&path).expect("the plant file").replace("retain = true\n", "");
    std::fs::write(&path, text).expect("the plant file");
    let (_, summary) = run(folder.path(), "100ms");
    assert!(summary["retained"].is_null() && !folder.path().join("data").join(FILES[0]).exists());
}

/// A process that ends with the test.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn a_plant_that_is_killed_while_it_saves_always_starts_and_goes_on_from_what_was_saved() {
    let folder = plant("10ms");
    let data = folder.path().join("data");
    let (mut before, mut random) = (Found::default(), 0x9e37_79b9_7f4a_7c15u64);
    for kill in 0..KILLS {
        let errors = std::fs::File::create(folder.path().join("errors")).expect("a file");
        let child = latchwork(folder.path()).stdout(Stdio::null()).stderr(errors).spawn().expect("it starts");
        let mut process = Process(child);
        // Both have gone on: what they save is more than what they have found. One may be on the disk before the other.
        let end = Instant::now() + LONG;
        let gone_on = |found: &Found| ["a", "b"].iter().all(|block| count(found, block) > count(&before, block));
        while !gone_on(&read(&data)) {
            let told = || std::fs::read_to_string(folder.path().join("errors")).unwrap_or_default();
            assert_eq!(process.0.try_wait().expect("its state"), None, "kill {kill}: it has ended: {}", told());
            assert!(Instant::now() < end, "kill {kill}: it saves nothing: {}", told());
            std::thread::sleep(Duration::from_millis(2));
        }
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        std::thread::sleep(Duration::from_micros(random % 30_000));
        process.0.kill().expect("it is killed");
        process.0.wait().expect("it ends");
        let found = read(&data);
        assert!(found.slot.is_some() && found.generation > before.generation, "kill {kill}: {found:?}");
        for block in ["a", "b"] {
            let cells = &found.retained.blocks[block].cells;
            assert_eq!(cells[0], cells[1], "kill {kill}: half of a state");
            let was = count(&before, block);
            assert!(cells[0] > was, "kill {kill}: {block} went back from {was} to {}", cells[0]);
        }
        if kill % 20 == 19 {
            // The very number that was saved is the one it goes on from.
            let (first, _) = run(folder.path(), "10ms");
            assert_eq!(first, (count(&found, "a") + 1).to_string(), "kill {kill}");
        }
        before = read(&data);
    }
}
