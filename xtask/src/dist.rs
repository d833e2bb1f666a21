//! `cargo xtask dist`: archives with the program, the components, the examples, the book and a systemd unit.
//!
//! Two runs over the same sources make the same archive: entries are sorted and carry no time and no owner.

use crate::cargo::{root, run, target_dir};
use crate::cross::Machine;
use crate::guests;
use anyhow::{Context, Result, bail};
use clap::Args;
use flate2::{Compression, GzBuilder};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Arguments of `cargo xtask dist`.
#[derive(Args, Debug)]
pub(crate) struct Dist {
    /// Only for this machine.
    #[arg(long)]
    target: Option<Machine>,
    /// Unpack the archive for x86-64, run its program on its examples and let systemd judge the unit.
    #[arg(long = "try")]
    attempt: bool,
}

pub(crate) fn execute(args: &Dist) -> Result<()> {
    guests::execute(&guests::Guests::default())?;
    if args.attempt {
        attempt(Machine::X86)?;
        return verify_unit();
    }
    for machine in [Machine::X86, Machine::Aarch64] {
        if args.target.is_none_or(|t| t == machine) {
            archive(machine)?;
        }
    }
    Ok(())
}

/// Makes the archive of a machine like this one, unpacks it and runs its program on its examples, as docs/install.md does.
pub(crate) fn attempt(machine: Machine) -> Result<()> {
    let archive = archive(machine)?;
    let folder = unpacked()?;
    if folder.exists() {
        std::fs::remove_dir_all(&folder).with_context(|| format!("{} cannot be removed", folder.display()))?;
    }
    std::fs::create_dir_all(&folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    run(Command::new("tar").arg("-xzf").arg(&archive).arg("-C").arg(&folder).arg("--strip-components=1"))?;
    for (example, time) in [("alarm-unit", "60s"), ("fast-interlock", "2s")] {
        let records = folder.join(format!("{example}.jsonl"));
        let mut command = Command::new(folder.join("bin/latchwork"));
        command.current_dir(folder.join("examples").join(example));
        command.args(["run", "plant.toml", "--sim", "--speed", "max", "--for", time, "--stimulus", "stimulus.csv"]);
        command.args(["--quiet", "--no-cache", "--records"]).arg(&records).stdout(Stdio::null());
        run(&mut command)?;
        let text = std::fs::read_to_string(&records).with_context(|| format!("{}", records.display()))?;
        if text.lines().count() < 10 {
            bail!("{example} of {} has hardly any records", archive.display());
        }
    }
    Ok(())
}

/// Where [`attempt`] unpacks.
fn unpacked() -> Result<PathBuf> {
    Ok(target_dir()?.join("dist-unpacked"))
}

/// systemd finds nothing wrong with the unit of the archive that [`attempt`] has unpacked.
pub(crate) fn verify_unit() -> Result<()> {
    const UNIT: &str = "latchwork@.service";
    let folder = unpacked()?;
    let unit = folder.join(UNIT);
    let text = std::fs::read_to_string(&unit).with_context(|| format!("{} cannot be read", unit.display()))?;
    // It looks for the program where the unit says it stands.
    std::fs::write(&unit, text.replace("/opt/latchwork", &folder.display().to_string()))?;
    let output = Command::new("systemd-analyze").arg("verify").arg(&unit).output().context("systemd-analyze")?;
    let told = String::from_utf8_lossy(&output.stderr);
    // What it says of other units is another matter.
    let wrong: Vec<&str> = told.lines().filter(|l| l.contains("latchwork")).collect();
    if !output.status.success() || !wrong.is_empty() {
        bail!("systemd-analyze verify: {}\n{told}", output.status);
    }
    println!("{UNIT} is right");
    Ok(())
}

/// Makes the archive; its path.
fn archive(machine: Machine) -> Result<PathBuf> {
    let program = machine.build()?;
    let (folder, parts) = (target_dir()?.join("dist"), target_dir()?.join("dist-parts"));
    for folder in [&folder, &parts] {
        std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    }
    let stripped = parts.join(format!("latchwork-{}", machine.name()));
    let strip = if machine == Machine::Aarch64 { "aarch64-linux-gnu-strip" } else { "strip" };
    run(Command::new(strip).arg("-o").arg(&stripped).arg(&program))?;

    let name = format!("latchwork-{}-{}-linux", env!("CARGO_PKG_VERSION"), machine.name());
    let path = folder.join(format!("{name}.tar.gz"));
    let file = File::create(&path).with_context(|| format!("{} cannot be written", path.display()))?;
    let mut tar = tar::Builder::new(GzBuilder::new().mtime(0).write(file, Compression::best()));
    tar.mode(tar::HeaderMode::Deterministic);
    let mut add = |to: &str, from: &Path| -> Result<()> {
        tar.append_path_with_name(from, format!("{name}/{to}"))
            .with_context(|| format!("{} into the archive", from.display()))
    };
    add("bin/latchwork", &stripped)?;
    for component in files(&target_dir()?.join("components"))? {
        let file = component.file_name().map(|f| f.to_string_lossy().into_owned()).unwrap_or_default();
        // `stress` is for tests alone.
        if file.ends_with(".wasm") && file != "stress.wasm" {
            add(&format!("components/{file}"), &component)?;
        }
    }
    let root = root();
    for folder in ["examples/alarm-unit", "examples/fast-interlock", "docs", "wit/block", "wit/device"] {
        for file in files(&root.join(folder))? {
            let to = file.strip_prefix(&root).unwrap_or(&file).display().to_string();
            // In the archive the components stand elsewhere.
            let from = if to.ends_with("plant.toml") { moved(&file, &parts)? } else { file };
            add(&to, &from)?;
        }
    }
    for file in ["README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE", "packaging/latchwork@.service"] {
        let to = file.strip_prefix("packaging/").unwrap_or(file);
        add(to, &root.join(file))?;
    }
    tar.into_inner()?.finish()?;
    let size = std::fs::metadata(&path)?.len();
    println!("{} ({:.1} MB)", path.display(), size as f64 / 1e6);
    Ok(path)
}

/// A copy of an example's plant file that finds its components in the archive.
fn moved(plant: &Path, folder: &Path) -> Result<PathBuf> {
    let text = std::fs::read_to_string(plant).with_context(|| format!("{} cannot be read", plant.display()))?;
    let to = folder.join("plant.toml");
    std::fs::write(&to, text.replace("\"../../target/components\"", "\"../../components\""))?;
    Ok(to)
}

/// All files below a folder, sorted.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut list = Vec::new();
    let entries = std::fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        // Links inside wit/ lead to packages that are there anyway.
        if path.is_symlink() {
            continue;
        }
        if path.is_dir() { list.extend(files(&path)?) } else { list.push(path) }
    }
    list.sort();
    Ok(list)
}
