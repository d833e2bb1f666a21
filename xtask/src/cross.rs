//! Builds for other machines: a static one for x86-64, and one for a Raspberry Pi (aarch64).
//!
//! Both serve twice, so that the engine is compiled once for each: the static programs run in the virtual machine of
//! tests/gpio-vm and make the x86-64 archive; the aarch64 program is tried under qemu-user and makes the other archive.

use crate::cargo::{cargo, root, run, target_dir};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A machine that archives are made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Machine {
    /// Any Linux on x86-64; static, needs nothing.
    #[value(name = "x86_64")]
    X86,
    /// A Raspberry Pi 3 or newer with a 64-bit system, and boards like it; glibc 2.36 or newer (Debian 12).
    #[value(name = "aarch64")]
    Aarch64,
}

/// Programs that the virtual machine runs besides `latchwork`.
const PROBES: &[&str] = &["latchwork-gpio-probe", "latchwork-rppal-probe", "latchwork-gpio-field"];
/// The C compiler and linker for a Raspberry Pi.
const AARCH64_CC: &str = "aarch64-linux-gnu-gcc";
/// Runs programs for it.
const QEMU: &str = "qemu-aarch64-static";

impl Machine {
    /// As Rust calls it.
    pub(crate) fn triple(self) -> &'static str {
        match self {
            Self::X86 => "x86_64-unknown-linux-musl",
            Self::Aarch64 => "aarch64-unknown-linux-gnu",
        }
    }

    /// As archives call it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::X86 => "x86_64",
            Self::Aarch64 => "aarch64",
        }
    }

    /// Builds `latchwork` for it, with what its tests need; the program.
    pub(crate) fn build(self) -> Result<PathBuf> {
        let mut rustup = Command::new("rustup");
        run(rustup.args(["target", "add", self.triple()]).current_dir(root())).context("rustup adds the target")?;
        let mut command = cargo();
        command.args(["build", "--release", "--quiet", "--target", self.triple(), "--package", "latchwork-cli"]);
        match self {
            Self::X86 => {
                command.args(PROBES.iter().flat_map(|p| ["--package", p]));
            }
            Self::Aarch64 => {
                if Command::new(AARCH64_CC).arg("--version").output().is_err() {
                    bail!(
                        "{AARCH64_CC} is missing; `apt install gcc-aarch64-linux-gnu libc6-dev-arm64-cross` brings it"
                    );
                }
                command.env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER", AARCH64_CC);
            }
        }
        run(&mut command)?;
        Ok(target_dir()?.join(self.triple()).join("release/latchwork"))
    }
}

/// Does a step, or says in one line that its tools are missing; with `LATCHWORK_SKIP=never` that is an error. True when it was
/// done.
pub(crate) fn unless_missing(tools: &[(&str, &str)], step: impl FnOnce() -> Result<()>) -> Result<bool> {
    let missing = tools.iter().find(|(tool, _)| Command::new(tool).arg("--version").output().is_err());
    match missing {
        None => step().map(|()| true),
        Some((tool, package)) if std::env::var_os("LATCHWORK_SKIP").is_some_and(|s| s == "never") => {
            bail!("{tool} is missing; `apt install {package}` brings it")
        }
        Some((tool, package)) => {
            eprintln!("SKIPPED: {tool} is missing; `apt install {package}` brings it");
            Ok(false)
        }
    }
}

/// What the static programs need.
pub(crate) const STATIC_TOOLS: &[(&str, &str)] = &[("musl-gcc", "musl-tools")];
/// What judges the systemd unit.
pub(crate) const UNIT_TOOLS: &[(&str, &str)] = &[("systemd-analyze", "systemd")];
/// What the emulated Raspberry Pi needs.
pub(crate) const AARCH64_TOOLS: &[(&str, &str)] =
    &[(AARCH64_CC, "gcc-aarch64-linux-gnu libc6-dev-arm64-cross"), (QEMU, "qemu-user-static")];

/// The example's virtual-time run on both machines: the records and the trace must be equal to the byte.
pub(crate) fn compare_under_qemu(native: &Path) -> Result<()> {
    let program = Machine::Aarch64.build()?;
    let folder = target_dir()?.join("aarch64-run");
    std::fs::create_dir_all(&folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    let arguments = |name: &str| -> Vec<PathBuf> {
        let example = root().join("examples/fast-interlock");
        let words = ["run".into(), example.join("plant.toml"), "--sim".into(), "--speed".into(), "max".into()];
        let more = ["--for".into(), "3s".into(), "--stimulus".into(), example.join("stimulus.csv")];
        let files = ["--records".into(), folder.join(format!("{name}.jsonl"))];
        let trace = ["--trace".into(), folder.join(format!("{name}.csv")), "--no-cache".into()];
        words.into_iter().chain(more).chain(files).chain(trace).collect()
    };
    run(Command::new(native).args(arguments("native")).stdout(std::process::Stdio::null()))?;
    let mut emulated = Command::new(QEMU);
    emulated.env("QEMU_LD_PREFIX", "/usr/aarch64-linux-gnu").arg(&program).args(arguments("aarch64"));
    run(emulated.stdout(std::process::Stdio::null()))?;
    for ending in ["jsonl", "csv"] {
        let read = |name: &str| {
            let path = folder.join(format!("{name}.{ending}"));
            std::fs::read(&path).with_context(|| format!("{} cannot be read", path.display()))
        };
        let (native, emulated) = (read("native")?, read("aarch64")?);
        if native.len() < 10_000 || native != emulated {
            bail!("the example's {ending} is another one on aarch64: compare the files in {}", folder.display());
        }
    }
    println!("fast-interlock is the same on aarch64, to the byte");
    Ok(())
}
