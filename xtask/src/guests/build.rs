//! Calls cargo so that core modules come out small, and the same on every machine.

use super::find::Crate;
use crate::cargo::{cargo, root, run};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const TARGET: &str = "wasm32-unknown-unknown";

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

/// Makes sure that the Rust toolchain has the wasm target.
pub(super) fn need_target() -> Result<()> {
    if has_target()? {
        return Ok(());
    }
    eprintln!("adding the target {TARGET} to the Rust toolchain");
    let added =
        Command::new("rustup").args(["target", "add", TARGET]).current_dir(root()).stdout(Stdio::null()).status();
    match added {
        Ok(status) if status.success() && has_target()? => Ok(()),
        Ok(_) => bail!(
            "`rustup target add {TARGET}` failed; without a network, install the target another way and try again"
        ),
        Err(_) => bail!(
            "the Rust toolchain lacks the target {TARGET} and there is no rustup to add it; \
             install your distribution's package of Rust's wasm32 standard library (Debian: libstd-rust-dev-wasm32), or rustup"
        ),
    }
}

fn has_target() -> Result<bool> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output =
        Command::new(rustc).args(["--print", "target-libdir", "--target", TARGET]).current_dir(root()).output();
    let output =
        output.context("rustc could not be started; this project needs a Rust toolchain (https://rustup.rs)")?;
    let folder = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    Ok(output.status.success() && std::fs::read_dir(folder).is_ok_and(|mut d| d.next().is_some()))
}

/// Builds crates of this workspace in one call; the paths of their core modules.
pub(super) fn workspace(crates: &[Crate], target: &Path) -> Result<Vec<PathBuf>> {
    eprintln!("building {} function blocks", crates.len());
    let mut command = cargo();
    command.args(["build", "--profile", "guest", "--target", TARGET]);
    for krate in crates {
        command.args(["--package", &krate.package]);
    }
    run(command.env("CARGO_ENCODED_RUSTFLAGS", flags(&root())))?;
    Ok(crates.iter().map(|c| module(c, target)).collect())
}

/// Builds the crate of a folder anywhere.
pub(super) fn folder(krate: &Crate, folder: &Path, target: &Path) -> Result<PathBuf> {
    eprintln!("building {}", krate.package);
    let folder = std::fs::canonicalize(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut command = Command::new(cargo().get_program());
    command.args(["build", "--profile", "guest", "--target", TARGET, "--package", &krate.package]).current_dir(&folder);
    for setting in PROFILE {
        command.args(["--config", setting]);
    }
    let built = run(command.env("CARGO_ENCODED_RUSTFLAGS", flags(&folder)));
    built.with_context(|| format!("{} does not build; cargo's messages are above", krate.package))?;
    Ok(module(krate, target))
}

fn module(krate: &Crate, target: &Path) -> PathBuf {
    target.join(TARGET).join("guest").join(&krate.module)
}

/// A 16 KiB shadow stack instead of 1 MiB, and no path of this machine in a panic's location.
fn flags(folder: &Path) -> String {
    let mut flags = vec!["-Clink-arg=-zstack-size=16384".to_owned()];
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
