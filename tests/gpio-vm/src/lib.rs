//! A virtual machine with a simulated GPIO chip, for tests: `vm.sh` boots it, this judges what it says.
//!
//! What runs in it is built statically by `cargo xtask static`. Where the machine cannot be had (no QEMU, no package of the
//! kernel) the tests say so in one line and pass over; in `.ci/run` everything is installed.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// Exit code of `vm.sh` where there is no machine to be had.
const CANNOT: i32 = 77;

/// The build folder this test was built in.
///
/// # Panics
/// If the test's program does not stand in one.
pub fn target() -> PathBuf {
    let exe = std::env::current_exe().expect("this program has a path");
    exe.ancestors().nth(3).expect("a test stands three folders below the build folder").to_path_buf()
}

/// The folder of the project.
pub fn project() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).expect("tests/gpio-vm stands in the project").to_path_buf()
}

/// A program that `cargo xtask static` has built.
///
/// # Panics
/// If it has not.
pub fn program(name: &str) -> PathBuf {
    let path = target().join("x86_64-unknown-linux-musl/release").join(name);
    assert!(path.is_file(), "{} is missing: run `cargo xtask static` first", path.display());
    path
}

/// Files for the machine's folder `/t`.
pub struct Files(TempDir);

impl Files {
    /// No files yet.
    ///
    /// # Panics
    /// If a temporary folder cannot be made.
    pub fn new() -> Self {
        Self(TempDir::new().expect("a temporary folder"))
    }

    /// With a file or a folder, copied.
    ///
    /// # Panics
    /// If it cannot be copied.
    pub fn with(self, from: &Path) -> Self {
        let status = Command::new("cp").arg("-rL").arg(from).arg(self.0.path()).status();
        assert!(status.is_ok_and(|s| s.success()), "{} could not be copied", from.display());
        self
    }
}

impl Default for Files {
    fn default() -> Self {
        Self::new()
    }
}

/// Runs a program of checks in the machine: every one must be ok, and there must be some.
///
/// # Panics
/// With the console's text if a check has failed or the machine broke.
pub fn run_checks(files: &Files, command: &[&str]) {
    let mut vm = Command::new(project().join("tests/gpio-vm/vm.sh"));
    vm.arg(target().join("gpio-vm")).arg(files.0.path()).args(command).stderr(Stdio::piped()).stdout(Stdio::piped());
    let output = vm.output().expect("bash runs vm.sh");
    let (console, said) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    if output.status.code() == Some(CANNOT) {
        assert!(std::env::var_os("CI").is_none(), "{said}");
        println!("SKIPPED: {}", said.trim());
        return;
    }
    let ok = console.lines().filter(|l| l.starts_with("ok ")).count();
    let ended = console.lines().any(|l| l == "rc=0");
    assert!(output.status.success() && ended && ok > 0, "{ok} checks are ok, but:\n{console}\n{said}");
    println!("{ok} checks in the virtual machine");
}
