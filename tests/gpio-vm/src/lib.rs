//! A virtual machine with a simulated GPIO chip, for tests: `vm.sh` boots it, this judges what it says.
//!
//! What runs in it is built statically by `cargo xtask static`. Where the machine cannot be had (no QEMU, no package of the
//! kernel) the tests say so in one line and pass over, unless `LATCHWORK_SKIP=never`; `.ci/run` installs everything.

use std::io::Write;
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

/// A program that `cargo xtask static` builds.
pub fn program(name: &str) -> PathBuf {
    target().join("x86_64-unknown-linux-musl/release").join(name)
}

/// Files for the machine's folder `/t`.
pub struct Files {
    folder: TempDir,
    missing: Option<PathBuf>,
}

impl Files {
    /// No files yet.
    ///
    /// # Panics
    /// If a temporary folder cannot be made.
    pub fn new() -> Self {
        Self { folder: TempDir::new().expect("a temporary folder"), missing: None }
    }

    /// With a file or a folder, copied; one that is missing is told when the machine is to run.
    ///
    /// # Panics
    /// If it cannot be copied.
    pub fn with(mut self, from: &Path) -> Self {
        if !from.exists() {
            self.missing.get_or_insert(from.into());
            return self;
        }
        let status = Command::new("cp").arg("-rL").arg(from).arg(self.folder.path()).status();
        assert!(status.is_ok_and(|s| s.success()), "{} could not be copied", from.display());
        self
    }
}

impl Default for Files {
    fn default() -> Self {
        Self::new()
    }
}

/// Says that a test is passed over, also where the test's own output is captured.
///
/// # Panics
/// If nothing may be passed over.
fn skip(why: &str) {
    assert!(std::env::var_os("LATCHWORK_SKIP").is_none_or(|s| s != "never"), "{why}");
    // Nobody is left to tell if stderr is closed.
    let _ = writeln!(std::io::stderr(), "SKIPPED: {why}");
    // To cargo this test has passed; `cargo xtask test` counts it by this list.
    if let Some(list) = std::env::var_os("LATCHWORK_SKIPPED") {
        let file = std::fs::OpenOptions::new().create(true).append(true).open(list);
        let told = file.and_then(|mut f| writeln!(f, "{}", why.replace('\n', " ")));
        told.expect("the list of skipped tests can be written");
    }
}

/// Times a machine is booted again whose kernel has crashed.
const BOOTS: usize = 4;

/// Runs a program of checks in the machine: every one must be ok, and there must be `checks` of them.
///
/// Debian's kernel 6.1 has a fault of its own: a GPIO chip that goes away while lines of it are requested may crash the kernel
/// (a use after free in gpiolib, mended in 6.8). A machine that died of that has shown nothing and is booted again; a check
/// that has failed is never repeated.
///
/// # Panics
/// With the console's text if a check has failed or the machine broke.
pub fn run_checks(files: &Files, command: &[&str], checks: usize) {
    if let Some(missing) = &files.missing {
        skip(&format!("{} is missing: run `cargo xtask guests` and `cargo xtask static` first", missing.display()));
        return;
    }
    for boot in 1..=BOOTS {
        let mut vm = Command::new(project().join("tests/gpio-vm/vm.sh"));
        vm.arg(target().join("gpio-vm"))
            .arg(files.folder.path())
            .args(command)
            .stderr(Stdio::piped())
            .stdout(Stdio::piped());
        let output = vm.output().expect("bash runs vm.sh");
        let (console, said) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        if output.status.code() == Some(CANNOT) {
            skip(said.trim());
            return;
        }
        let has = |what: &str| console.lines().any(|l| l.contains(what));
        if has("Kernel panic") && !console.lines().any(|l| l.starts_with("FAILED ")) && boot < BOOTS {
            println!("the machine's kernel has crashed; boot {} of {BOOTS}", boot + 1);
            continue;
        }
        let ok = console.lines().filter(|l| l.starts_with("ok ")).count();
        let ended = console.lines().any(|l| l == "rc=0");
        assert!(output.status.success() && ended && ok == checks, "{ok} of {checks} checks are ok:\n{console}\n{said}");
        console.lines().filter(|l| l.starts_with("note: ")).for_each(|l| println!("{l}"));
        println!("{ok} checks in the virtual machine");
        return;
    }
}
