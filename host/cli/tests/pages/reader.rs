//! Somebody who does what a page says, in an empty folder.

use crate::kept;
use crate::page::Step;
use latchwork_author::Language;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longer than any command takes on a busy machine; Python's compiler takes half a minute of processor time.
const LONGEST: Duration = Duration::from_secs(600);
/// What the pages say of where Latchwork was installed.
const INSTALLED: &str = "/opt/latchwork/components";

pub(crate) struct Reader {
    language: Language,
    folder: TempDir,
    /// Files that `new` has written, below the block's folder.
    files: Vec<String>,
    /// `run … &`
    plant: Option<Child>,
    socket: Option<String>,
    /// What the last command said.
    said: String,
    /// First words of the commands of `latchwork` so far.
    done: Vec<String>,
}

impl Drop for Reader {
    fn drop(&mut self) {
        if let Some(plant) = &mut self.plant {
            // Not `kill`: the plant is a child of that which bounds its time.
            let _ = terminate(plant);
        }
    }
}

fn target() -> PathBuf {
    let exe = Path::new(env!("CARGO_BIN_EXE_latchwork"));
    exe.ancestors().nth(2).expect("the binary stands in target/release").to_path_buf()
}

impl Reader {
    pub(crate) fn new(language: Language) -> Self {
        let components = target().join("components");
        assert!(components.is_dir(), "{} is missing: run `cargo xtask guests` first", components.display());
        // Packages are linked from the build folder, and Node finds them by where a project really is.
        let folder = tempfile::tempdir_in(target()).expect("a folder");
        Self { language, folder, files: Vec::new(), plant: None, socket: None, said: String::new(), done: Vec::new() }
    }

    /// Does one step; an error says which tool is missing.
    pub(crate) fn take(&mut self, step: &Step) -> Result<(), String> {
        match step {
            Step::Save { path, text } => {
                let text = text.replace(INSTALLED, &target().join("components").display().to_string());
                std::fs::write(self.folder.path().join(path), text).expect("the file is saved");
            }
            Step::Shows(text) => assert_eq!(&self.said, text, "the page shows something else"),
            Step::Run(line) => {
                let words: Vec<&str> = line.split_whitespace().collect();
                if let ["latchwork", command, ..] = words[..] {
                    self.done.push(command.to_owned());
                }
                match words[..] {
                    ["latchwork", "new", name, ..] => {
                        self.run(line);
                        self.files = files(&self.folder.path().join(name));
                    }
                    ["latchwork", "build", name] => self.build(name, line)?,
                    ["latchwork", "watch", ..] => self.until_it_says_true(line),
                    ["latchwork", "run", .., "&"] => {
                        let mut plant = self.shell(&format!("exec {}", line.trim_end_matches('&')));
                        self.plant = Some(plant.stdout(Stdio::null()).spawn().expect("the plant starts"));
                    }
                    ["export", _] => {
                        self.run(&format!("{line}; echo $LATCHWORK_SOCKET"));
                        self.socket = Some(self.said.trim().to_owned());
                        self.until_it_answers();
                    }
                    ["kill", "%1"] => self.end(),
                    _ => self.run(line),
                }
            }
        }
        Ok(())
    }

    /// The page was no shorter than it is to be.
    pub(crate) fn has_done_everything(&self) {
        for command in ["new", "build", "test", "inspect", "fuzz", "check", "run", "set", "swap", "watch"] {
            assert!(self.done.iter().any(|d| d == command), "the page has no `latchwork {command}`");
        }
        assert!(self.plant.is_none(), "the page leaves its plant running");
    }

    /// A line of a shell that finds this build of `latchwork`.
    fn shell(&self, line: &str) -> Command {
        let own = Path::new(env!("CARGO_BIN_EXE_latchwork")).parent().expect("a folder").to_path_buf();
        let path = std::env::var_os("PATH").unwrap_or_default();
        let path = std::env::join_paths(std::iter::once(own).chain(std::env::split_paths(&path))).expect("PATH");
        let mut command = Command::new("timeout");
        command.args(["--foreground", &format!("{}s", LONGEST.as_secs()), "bash", "-c", line]);
        command.current_dir(self.folder.path()).env("PATH", path).env("NO_COLOR", "1").stdin(Stdio::null());
        command.env("LATCHWORK_CACHE", target().join("test-cache")).env_remove("LATCHWORK_SOCKET");
        if let Some(socket) = &self.socket {
            command.env("LATCHWORK_SOCKET", socket);
        }
        command
    }

    fn run(&mut self, line: &str) {
        let output = self.shell(line).output().expect("bash starts");
        self.said = said(line, &output);
    }

    /// Builds, unless that was done before.
    fn build(&mut self, name: &str, line: &str) -> Result<(), String> {
        let project = self.folder.path().join(name);
        let files = self.files.clone();
        kept::component(&target(), self.language, &project, &files, || {
            let output = self.shell(&format!("{line} --json")).output().expect("bash starts");
            let errors = String::from_utf8_lossy(&output.stderr);
            if errors.contains("is not installed, and") {
                return Err(errors.into_owned());
            }
            let built: serde_json::Value = serde_json::from_str(&said(line, &output)).expect("JSON");
            let imports = built["imports"].as_array().expect("a list");
            Ok(imports.iter().filter_map(|i| i.as_str()).map(str::to_owned).collect())
        })
        .map(|_| ())
    }

    /// Runs a command that goes on for ever until a line of it has the word.
    fn until_it_says_true(&self, line: &str) {
        let mut child = self.shell(&format!("exec {line}")).stdout(Stdio::piped()).spawn().expect("bash starts");
        let (lines, seen) = mpsc::channel();
        let out = BufReader::new(child.stdout.take().expect("its output"));
        let reading = std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                // Nobody listens any more once the word was there.
                let _ = lines.send(line);
            }
        });
        let mut all = Vec::new();
        let end = Instant::now() + Duration::from_secs(60);
        let found = loop {
            match seen.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(line) if line.contains("true") => break true,
                Ok(line) => all.push(line),
                Err(_) => break false,
            }
        };
        terminate(&mut child);
        let _ = reading.join();
        assert!(found, "{line}: it does not say `true`: {all:#?}");
    }

    fn until_it_answers(&mut self) {
        let end = Instant::now() + LONGEST;
        while !self.shell("latchwork status").output().expect("bash starts").status.success() {
            let plant = self.plant.as_mut().expect("a plant was started");
            assert_eq!(plant.try_wait().expect("its state"), None, "the plant has ended");
            assert!(Instant::now() < end, "the plant does not answer");
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    fn end(&mut self) {
        let mut plant = self.plant.take().expect("a plant runs");
        let status = terminate(&mut plant);
        assert!(status.success(), "the plant ended with {status}");
    }
}

/// Asks it to end, and waits.
fn terminate(child: &mut Child) -> std::process::ExitStatus {
    let pid = rustix::process::Pid::from_child(child);
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).expect("it is ours");
    child.wait().expect("it ends")
}

/// What a command said that must succeed.
fn said(line: &str, output: &Output) -> String {
    let (out, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "$ {line}\n{out}{errors}{}", output.status);
    out.into_owned()
}

/// All files of a folder, below it.
fn files(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(&next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.push(path.strip_prefix(folder).expect("below it").display().to_string());
            }
        }
    }
    found
}
