//! Calls cargo so that core modules come out small, and the same on every machine.

use super::find::Crate;
use crate::cargo::{cargo, root, run};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What function blocks are built for: nothing but the module itself.
const BLOCK: &str = "wasm32-unknown-unknown";
/// What loggers are built for: WASI 0.2; the linker makes the component.
const LOGGER: &str = "wasm32-wasip2";

fn target_of(krate: &Crate) -> &'static str {
    if krate.logger { LOGGER } else { BLOCK }
}

/// What the workspace's `[profile.guest]` says, for a crate that does not know this workspace.
const PROFILE: [&str; 8] = [
    "profile.guest.inherits='release'",
    "profile.guest.opt-level='s'",
    "profile.guest.lto=true",
    "profile.guest.codegen-units=1",
    "profile.guest.panic='abort'",
    "profile.guest.strip=true",
    "profile.guest.debug=0",
    "profile.guest.overflow-checks=true",
];

/// Makes sure that the Rust toolchain has the wasm targets of some crates.
pub(super) fn need_targets(crates: &[Crate]) -> Result<()> {
    [BLOCK, LOGGER].into_iter().filter(|t| crates.iter().any(|c| target_of(c) == *t)).try_for_each(need_target)
}

fn need_target(target: &str) -> Result<()> {
    if has_target(target)? {
        return Ok(());
    }
    eprintln!("adding the target {target} to the Rust toolchain");
    let added =
        Command::new("rustup").args(["target", "add", target]).current_dir(root()).stdout(Stdio::null()).status();
    match added {
        Ok(status) if status.success() && has_target(target)? => Ok(()),
        Ok(_) => bail!(
            "`rustup target add {target}` failed; without a network, install the target another way and try again"
        ),
        Err(_) => bail!(
            "the Rust toolchain lacks the target {target} and there is no rustup to add it; \
             install your distribution's package of Rust's wasm32 standard library (Debian: libstd-rust-dev-wasm32), or rustup"
        ),
    }
}

fn has_target(target: &str) -> Result<bool> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output =
        Command::new(rustc).args(["--print", "target-libdir", "--target", target]).current_dir(root()).output();
    let output =
        output.context("rustc could not be started; this project needs a Rust toolchain (https://rustup.rs)")?;
    let folder = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    Ok(output.status.success() && std::fs::read_dir(folder).is_ok_and(|mut d| d.next().is_some()))
}

/// Builds crates of this workspace, in one call those of a kind; the paths of their core modules or, of loggers, components.
pub(super) fn workspace(crates: &[Crate], target: &Path) -> Result<Vec<PathBuf>> {
    for (wasm, what) in [(BLOCK, "function blocks"), (LOGGER, "loggers")] {
        let some: Vec<&Crate> = crates.iter().filter(|c| target_of(c) == wasm).collect();
        if some.is_empty() {
            continue;
        }
        eprintln!("building {} {what}", some.len());
        let mut command = cargo();
        command.args(["build", "--profile", "guest", "--target", wasm]);
        for krate in some {
            command.args(["--package", &krate.package]);
        }
        run(command.env("CARGO_ENCODED_RUSTFLAGS", flags(&root(), wasm)))?;
    }
    Ok(crates.iter().map(|c| module(c, target)).collect())
}

/// Builds the crate of a folder anywhere.
pub(super) fn folder(krate: &Crate, folder: &Path, target: &Path) -> Result<PathBuf> {
    eprintln!("building {}", krate.package);
    let folder = std::fs::canonicalize(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut command = Command::new(cargo().get_program());
    let wasm = target_of(krate);
    command.args(["build", "--profile", "guest", "--target", wasm, "--package", &krate.package]).current_dir(&folder);
    for setting in PROFILE {
        command.args(["--config", setting]);
    }
    let built = run(command.env("CARGO_ENCODED_RUSTFLAGS", flags(&folder, wasm)));
    built.with_context(|| format!("{} does not build; cargo's messages are above", krate.package))?;
    Ok(module(krate, target))
}

fn module(krate: &Crate, target: &Path) -> PathBuf {
    target.join(target_of(krate)).join("guest").join(&krate.module)
}

/// No path of this machine in a panic's location; for blocks, a 16 KiB shadow stack instead of 1 MiB.
fn flags(folder: &Path, wasm: &str) -> String {
    let mut flags = Vec::new();
    if wasm == BLOCK {
        flags.push("-Clink-arg=-zstack-size=16384".to_owned());
    }
    // The last that fits wins.
    let mut remapped: Vec<(PathBuf, &str)> = registries().into_iter().map(|r| (r, "/registry")).collect();
    remapped.extend([(folder.to_path_buf(), "/block"), (root(), "/latchwork")]);
    for (from, to) in remapped {
        flags.push(format!("--remap-path-prefix={}={to}", from.display()));
    }
    flags.join("\u{1f}")
}

/// Folders of unpacked crates, each with the name of its registry, which may be a mirror.
fn registries() -> Vec<PathBuf> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| std::env::home_dir().map(|h| h.join(".cargo")));
    let entries = home.and_then(|h| std::fs::read_dir(h.join("registry/src")).ok());
    let mut folders: Vec<PathBuf> = entries.into_iter().flatten().flatten().map(|e| e.path()).collect();
    folders.sort();
    folders
}
