//! `latchwork run` as a user starts it, and its records.

use rustix::process::{Pid, PidfdFlags, PidfdGetfdFlags, Signal, kill_process, pidfd_getfd, pidfd_open};
use serde_json::Value;
use std::fs::File;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

/// Where the records go.
const RECORDS: &str = "/tmp/records.jsonl";
/// Where the plant's copy stands, and what its operator does.
const PLANT: &str = "/tmp/plant.toml";
const COMMANDS: &str = "/tmp/commands.csv";

/// A plant that runs.
pub(crate) struct Run {
    child: Child,
}

impl Run {
    /// Starts the example, its chip and limits adapted, on demand with another period of the main lane.
    pub(crate) fn start(chip: &str, main: Option<&str>) -> Result<Self, String> {
        let text = std::fs::read_to_string("fast-interlock/plant.toml").map_err(|e| format!("the example: {e}"))?;
        let text = replace(&text, "\"../../target/components\"", "\"/t/components\"")?;
        let text = replace(&text, "\"/dev/gpiochip0\"", &format!("\"{chip}\""))?;
        // As fast as the simulator makes them, which is no storm; a small machine emulates this one.
        let text =
            replace(&text, "also-with = \"main\"", "storm-limit = 1000000\nwatchdog = \"30s\"\nalso-with = \"main\"")?;
        let text = replace(&text, "watchdog = \"50ms\"", "watchdog = \"30s\"")?;
        let text = text.replace("\ncomponent = ", "\nbudget = \"10s\"\ncomponent = ");
        let text = match main {
            Some(period) => replace(&text, "every = \"10ms\"", &format!("every = \"{period}\""))?,
            None => text,
        };
        std::fs::write(PLANT, text).map_err(|e| format!("{PLANT}: {e}"))?;
        std::fs::write(COMMANDS, commands()).map_err(|e| format!("{COMMANDS}: {e}"))?;
        let _ = std::fs::remove_file(RECORDS);
        let log = File::create("/tmp/latchwork.log").map_err(|e| e.to_string())?;
        let child = Command::new("./latchwork")
            .args(["run", PLANT, "--records", RECORDS, "--stimulus", COMMANDS])
            .stdout(log.try_clone().map_err(|e| e.to_string())?)
            .stderr(log)
            .spawn()
            .map_err(|e| format!("latchwork: {e}"))?;
        Ok(Self { child })
    }

    fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// Duplicates of the requests it holds: with them the lines stay as they are when it ends.
    pub(crate) fn hold_lines(&self) -> Result<Vec<OwnedFd>, String> {
        let process = pidfd_open(self.pid(), PidfdFlags::empty()).map_err(|e| format!("pidfd: {e}"))?;
        let folder = format!("/proc/{}/fd", self.child.id());
        let mut held = Vec::new();
        for entry in std::fs::read_dir(&folder).map_err(|e| format!("{folder}: {e}"))?.flatten() {
            let to = std::fs::read_link(entry.path()).unwrap_or_default();
            let number = entry.file_name().to_string_lossy().parse();
            if let (true, Ok(number)) = (to.to_string_lossy().contains("gpio-line"), number) {
                held.push(pidfd_getfd(&process, number, PidfdGetfdFlags::empty()).map_err(|e| format!("getfd: {e}"))?);
            }
        }
        if held.is_empty() { Err("latchwork holds no line".into()) } else { Ok(held) }
    }

    /// Sends a signal and waits for the end.
    pub(crate) fn end(mut self, signal: Signal) -> Result<ExitStatus, String> {
        kill_process(self.pid(), signal).map_err(|e| format!("kill: {e}"))?;
        let end = Instant::now() + Duration::from_secs(30);
        loop {
            match self.child.try_wait() {
                Ok(Some(status)) => return Ok(status),
                Ok(None) if Instant::now() < end => std::thread::sleep(Duration::from_millis(10)),
                other => return Err(format!("latchwork did not end after {signal:?}: {other:?}")),
            }
        }
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        // Only where a check has given up.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// An operator who acknowledges whatever there is, again and again.
fn commands() -> String {
    let blocks =
        ["door-open", "beam-lost", "vacuum-lost", "level-low", "air-low", "heat-high", "shutter", "source", "pump"];
    let mut text = String::from("time,tag,value\n");
    for at in 1..300 {
        let at = 400 * at;
        blocks.iter().for_each(|b| text.push_str(&format!("{at}ms,{b}.commands.acknowledge,true\n")));
        text.push_str(&format!("{}ms,source.commands.allow-restart,true\n", at + 100));
    }
    text
}

fn replace(text: &str, from: &str, to: &str) -> Result<String, String> {
    if text.contains(from) { Ok(text.replacen(from, to, 1)) } else { Err(format!("the example has no {from}")) }
}

/// The file of records so far.
pub(crate) fn text() -> String {
    std::fs::read_to_string(RECORDS).unwrap_or_default()
}

/// All records so far; a line that is being written is left out.
pub(crate) fn records() -> Vec<Value> {
    text().lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

/// Records with these words as source and transition.
pub(crate) fn told(source: &str, transition: &str) -> Vec<Value> {
    records().into_iter().filter(|r| r["source"] == source && r["transition"] == transition).collect()
}

/// Waits until something holds; a word what was waited for otherwise, with what latchwork has said.
pub(crate) fn until(what: &str, holds: impl FnMut() -> bool) -> Result<(), String> {
    within(Duration::from_secs(40), what, holds)
}

/// The same, not longer than this.
pub(crate) fn within(limit: Duration, what: &str, mut holds: impl FnMut() -> bool) -> Result<(), String> {
    let end = Instant::now() + limit;
    while !holds() {
        if Instant::now() > end {
            let log = std::fs::read_to_string(Path::new("/tmp/latchwork.log")).unwrap_or_default();
            let last: Vec<_> = records().into_iter().rev().take(8).map(|r| r.to_string()).collect();
            return Err(format!(
                "waited in vain for {limit:?}: {what}\n{log}\nlast records, newest first:\n{}",
                last.join("\n")
            ));
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    Ok(())
}
