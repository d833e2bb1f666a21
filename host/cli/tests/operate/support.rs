//! A plant in a process of its own, and commands on it.
#![allow(dead_code, reason = "each test program uses a part of it")]

use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longer than anything here takes on a busy machine; a wait that long is a failure.
pub(crate) const LONG: Duration = Duration::from_secs(60);

/// A plant that runs; it ends with the test.
pub(crate) struct Running {
    pub(crate) folder: TempDir,
    pub(crate) child: Child,
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Exit code, output, errors.
pub(crate) type Said = (Option<i32>, String, String);

pub(crate) fn target() -> PathBuf {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    exe.ancestors().nth(2).expect("the binary stands in target/release").to_path_buf()
}

/// Starts a plant and waits until it answers.
pub(crate) fn start(policy: &str) -> Running {
    let components = target().join("components");
    assert!(components.is_dir(), "{} is missing: run `cargo xtask guests` first", components.display());
    let folder = TempDir::new().expect("a temporary folder");
    let text = format!(
        r#"[plant]
name = "pumps"
components = [{:?}]
[lane.main]
every = "10ms"
watchdog = "10s"
[driver.field]
kind = "sim"
[driver.field.points]
level = {{ type = "u16", initial = 15000 }}
door = {{ type = "bool" }}
smoke = {{ type = "bool" }}
lamp = {{ type = "bool", from = "unit.outputs.lamp" }}
[block.unit]
component = "alarm-unit"
lane = "main"
budget = "5s"
inputs.level = "field.level"
inputs.door = "field.door"
[block.fire]
component = "digital-alarm"
lane = "main"
budget = "5s"
inputs.input = "field.smoke"
inputs.disable = false
[[alarm]]
match = 'fire\.alarms\.alarm'
code = 0xCC00
priority = "urgent"
text = "smoke in the hall"
[[alarm]]
match = 'unit\.alarms\..*'
code = 0xC000
{policy}"#,
        components.display().to_string()
    );
    std::fs::write(folder.path().join("plant.toml"), text).expect("the plant file");
    let child = launch(folder.path());
    let mut running = Running { folder, child };
    running.until_it_answers();
    running
}

fn launch(folder: &Path) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.current_dir(folder).env("LATCHWORK_CACHE", target().join("test-cache"));
    command.args(["run", "plant.toml", "--quiet", "--for", "5m", "--data", "data", "--socket", "run/plant.sock"]);
    let errors = std::fs::File::create(folder.join("errors")).expect("a file");
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(errors).spawn().expect("it starts")
}

impl Running {
    /// Kills it and starts it again.
    pub(crate) fn again(&mut self) {
        self.child.kill().expect("it is ours");
        self.child.wait().expect("it ends");
        self.child = launch(self.folder.path());
        self.until_it_answers();
    }

    fn until_it_answers(&mut self) {
        let end = Instant::now() + LONG;
        while self.run(&["status"]).0 != Some(0) {
            if let Some(status) = self.child.try_wait().expect("its state") {
                panic!("it has ended, {status}: {}", self.errors());
            }
            assert!(Instant::now() < end, "it does not answer: {:?}", self.run(&["status"]));
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    pub(crate) fn socket(&self) -> PathBuf {
        self.folder.path().join("run/plant.sock")
    }

    /// What the plant's own process said.
    pub(crate) fn errors(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("errors")).expect("its errors")
    }

    /// A command on this plant.
    pub(crate) fn command(&self, program: &Path, args: &[&str]) -> Command {
        let mut command = Command::new(program);
        command.args(args).env("LATCHWORK_SOCKET", self.socket()).env("COLUMNS", "100").env("NO_COLOR", "1");
        command.current_dir("/").stdin(Stdio::null());
        command
    }

    pub(crate) fn run(&self, args: &[&str]) -> Said {
        said(&mut self.command(Path::new(env!("CARGO_BIN_EXE_latchwork")), args))
    }

    /// The output of a command that does what it should.
    #[track_caller]
    pub(crate) fn does(&self, args: &[&str]) -> String {
        let (code, out, errors) = self.run(args);
        assert_eq!(code, Some(0), "latchwork {}: {out}{errors}", args.join(" "));
        assert_eq!(errors, "", "latchwork {}", args.join(" "));
        out
    }

    /// The errors of a command that is refused.
    #[track_caller]
    pub(crate) fn refuses(&self, args: &[&str]) -> String {
        let (code, out, errors) = self.run(args);
        assert_eq!(code, Some(1), "latchwork {}: {out}{errors}", args.join(" "));
        assert!(errors.starts_with("error: ") && !errors.contains("panicked"), "{errors}");
        errors
    }

    #[track_caller]
    pub(crate) fn json(&self, args: &[&str]) -> Value {
        serde_json::from_str(&self.does(&[args, &["--json"]].concat())).expect("JSON")
    }

    /// The state of an alarm, once it is that.
    #[track_caller]
    pub(crate) fn until_alarm_is(&self, alarm: &str, state: &str) {
        let end = Instant::now() + LONG;
        loop {
            let all = self.json(&["alarms", "--all"]);
            let row = all.as_array().expect("a list").iter().find(|r| r["alarm"] == alarm).expect("the alarm").clone();
            if row["state"] == state {
                return;
            }
            assert!(Instant::now() < end, "{alarm} does not become {state}: {row}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Records that match, once there are so many of them on disk.
    #[track_caller]
    pub(crate) fn records(&self, count: usize, wanted: impl Fn(&Value) -> bool) -> Vec<Value> {
        let end = Instant::now() + LONG;
        loop {
            let out = self.does(&["records", "--json", "--after", "0", "--limit", "10000"]);
            let all = out.lines().map(|l| serde_json::from_str::<Value>(l).expect("a record"));
            let found: Vec<_> = all.filter(&wanted).collect();
            if found.len() >= count {
                return found;
            }
            assert!(Instant::now() < end, "only {found:#?} of\n{out}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

pub(crate) fn said(command: &mut Command) -> Said {
    let output = command.output().expect("it starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// Names what this machine lacks for a test.
pub(crate) fn skipped(why: &str) {
    eprintln!("SKIPPED {why}");
    if let Some(list) = std::env::var_os("LATCHWORK_SKIPPED") {
        let file = std::fs::OpenOptions::new().append(true).open(list);
        file.and_then(|mut f| writeln!(f, "{why}")).expect("the list of skipped tests");
    }
}
