//! The ways out of a running plant: whatever ends it, the outputs at the device get their safe values.
//!
//! The device is the simulated one of `examples/field-device`, in a process of its own, over real Modbus TCP.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use tempfile::TempDir;

/// Longer than anything here takes on a busy machine; a wait that long is a failure.
const LONG: Duration = Duration::from_secs(30);

fn target() -> PathBuf {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    exe.ancestors().nth(2).expect("the binary stands in target/release").to_path_buf()
}

/// A process that ends with the test.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The device, its address and what it says.
fn device() -> (Process, String, Receiver<String>) {
    let path = target().join("release/field-device");
    assert!(path.is_file(), "{} is missing: run `cargo build --release --workspace --bins` first", path.display());
    let mut child = Command::new(path)
        .args(["--listen", "127.0.0.1:0", "--for", "2m", "--verbose"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the device starts");
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("its output")).read_line(&mut line).expect("its address");
    let said: serde_json::Value = serde_json::from_str(&line).expect("one line of JSON");
    let address = said["listening"].as_str().expect("an address").to_owned();
    let (sender, lines) = channel();
    let errors = BufReader::new(child.stderr.take().expect("its errors"));
    std::thread::spawn(move || errors.lines().map_while(Result::ok).try_for_each(|l| sender.send(l)));
    (Process(child), address, lines)
}

fn wait_for(lines: &Receiver<String>, what: &str) {
    let mut seen = Vec::new();
    loop {
        match lines.recv_timeout(LONG) {
            Ok(line) if line.contains(what) => return,
            Ok(line) => seen.push(line),
            Err(_) => panic!("the device never said \"{what}\"; it said {seen:?}"),
        }
    }
}

/// A plant whose lamp is on from the first scan on; a block that traps in its scan number `trap`, if it is not 0.
fn plant(address: &str, trap: u32) -> TempDir {
    let components = target().join("components");
    assert!(components.is_dir(), "{} is missing: run `cargo xtask guests` first", components.display());
    let folder = TempDir::new().expect("a temporary folder");
    let fault = if trap == 0 { "none" } else { "trap" };
    let text = format!(
        r#"[plant]
name = "stop"
components = [{:?}]
[lane.main]
every = "10ms"
watchdog = "2s"
[driver.field]
kind = "modbus-tcp"
address = "{address}"
every = "20ms"
[driver.field.points]
lamp = {{ coil = 0, from = "on.outputs.q1", safe = false }}
[block.on]
component = "sr"
lane = "main"
inputs.s1 = true
[block.bad]
component = "stress"
lane = "main"
on-fault = "stop-lane"
inputs.fault = "{fault}"
inputs.from = {trap}
"#,
        components.display().to_string()
    );
    std::fs::write(folder.path().join("plant.toml"), text).expect("the plant file");
    folder
}

fn latchwork(folder: &Path) -> Process {
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.current_dir(folder).env("LATCHWORK_CACHE", target().join("test-cache"));
    Process(
        command.args(["run", "plant.toml", "--for", "2m", "--quiet"]).stdout(Stdio::null()).spawn().expect("it starts"),
    )
}

fn signal(process: &Process, name: &str) {
    let sent = Command::new("kill").args([&format!("-{name}"), &process.0.id().to_string()]).status();
    assert!(sent.expect("kill").success());
}

#[test]
fn signals_stop_in_order_and_leave_the_outputs_safe() {
    for name in ["INT", "TERM", "HUP", "QUIT"] {
        let (_device, address, lines) = device();
        let folder = plant(&address, 0);
        let mut process = latchwork(folder.path());
        wait_for(&lines, "lamp on");
        signal(&process, name);
        let status = process.0.wait().expect("it ends");
        assert_eq!(status.code(), Some(0), "SIG{name}");
        wait_for(&lines, "lamp off");
    }
}

#[test]
fn a_fault_that_stops_the_lane_leaves_the_outputs_safe() {
    let (_device, address, lines) = device();
    let folder = plant(&address, 100);
    let mut process = latchwork(folder.path());
    wait_for(&lines, "lamp on");
    wait_for(&lines, "lamp off");
    let status = process.0.wait().expect("it ends");
    assert_eq!(status.code(), Some(3));
}

#[test]
fn a_plant_started_with_nohup_survives_the_end_of_its_terminal() {
    let (_device, address, lines) = device();
    let folder = plant(&address, 0);
    let mut command = Command::new("nohup");
    command.arg(env!("CARGO_BIN_EXE_latchwork")).args(["run", "plant.toml", "--for", "2m", "--quiet"]);
    command.current_dir(folder.path()).env("LATCHWORK_CACHE", target().join("test-cache"));
    let started = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    let mut process = Process(started.expect("nohup starts it"));
    wait_for(&lines, "lamp on");
    signal(&process, "HUP");
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(process.0.try_wait().expect("its state"), None, "it has ended");
    signal(&process, "TERM");
    assert_eq!(process.0.wait().expect("it ends").code(), Some(0));
    wait_for(&lines, "lamp off");
}

#[test]
fn a_fault_is_told_by_the_exit_code_although_a_file_is_incomplete() {
    let (_device, address, _lines) = device();
    let folder = plant(&address, 3);
    let mut command = Command::new(env!("CARGO_BIN_EXE_latchwork"));
    command.current_dir(folder.path()).env("LATCHWORK_CACHE", target().join("test-cache"));
    // A disk that is full.
    command.args(["run", "plant.toml", "--for", "2m", "--quiet", "--records", "/dev/full"]);
    let output = command.output().expect("it starts");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(told.contains("/dev/full is incomplete"), "{told}");
    assert_eq!(output.status.code(), Some(3), "{told}");
}
