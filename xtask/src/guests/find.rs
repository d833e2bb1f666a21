//! Which crates are function blocks and loggers, from cargo's own description of a workspace.

use crate::cargo::{cargo, root, shown};
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A crate that becomes a component.
pub(super) struct Crate {
    /// Name of the component: the package's without a leading `latchwork-`.
    pub(super) name: String,
    /// Name of the package.
    pub(super) package: String,
    /// File name of the core module cargo writes.
    pub(super) module: String,
    /// One of the project's own components, with limits to keep; otherwise a test's or an author's.
    pub(super) shipped: bool,
    /// A block of an example.
    pub(super) example: bool,
    /// A logger, built for WASI 0.2: its Cargo.toml says `[package.metadata.latchwork] logger = true`.
    pub(super) logger: bool,
}

/// The project's blocks, by name, and the target folder.
pub(super) fn of_workspace() -> Result<(Vec<Crate>, PathBuf)> {
    let mut command = cargo();
    let metadata = metadata(&mut command)?;
    let (components, guests, examples) =
        (root().join("components"), root().join("tests/guests"), root().join("examples"));
    let mut crates = Vec::new();
    for package in members(&metadata) {
        let manifest = Path::new(text(package, "manifest_path")?);
        let shipped = manifest.starts_with(&components);
        let example = manifest.starts_with(&examples);
        if shipped || example || manifest.starts_with(&guests) {
            crates.extend(read(package, shipped)?.map(|krate| Crate { example, ..krate }));
        }
    }
    crates.sort_by(|a, b| (!a.shipped, &a.name).cmp(&(!b.shipped, &b.name)));
    Ok((crates, target(&metadata)?))
}

/// The one block of a folder anywhere.
pub(super) fn in_folder(folder: &Path) -> Result<(Crate, PathBuf)> {
    let manifest = folder.join("Cargo.toml");
    if !manifest.is_file() {
        bail!("no Cargo.toml in {}; expected the folder of a crate", folder.display());
    }
    let mut command = Command::new(cargo().get_program());
    let metadata = metadata(command.arg("--color=never").current_dir(folder))?;
    let manifest = std::fs::canonicalize(&manifest).with_context(|| format!("cannot read {}", manifest.display()))?;
    for package in members(&metadata) {
        if Path::new(text(package, "manifest_path")?) == manifest {
            let krate = read(package, false)?;
            let krate = krate.with_context(|| {
                format!(
                    "{} is no function block; its Cargo.toml needs\n\n[lib]\ncrate-type = [\"cdylib\", \"lib\"]",
                    folder.display()
                )
            })?;
            return Ok((krate, target(&metadata)?));
        }
    }
    bail!("{} holds a workspace; expected the folder of one crate", folder.display())
}

/// Those of `all` that `names` name.
pub(super) fn choose(all: Vec<Crate>, names: &[String]) -> Result<Vec<Crate>> {
    let is = |c: &Crate, n: &String| c.name == *n || c.package == *n;
    if let Some(unknown) = names.iter().find(|n| !all.iter().any(|c| is(c, n))) {
        let known: Vec<&str> = all.iter().map(|c| c.name.as_str()).collect();
        bail!("no function block `{unknown}`; there are: {}", known.join(", "));
    }
    Ok(all.into_iter().filter(|c| names.is_empty() || names.iter().any(|n| is(c, n))).collect())
}

fn metadata(command: &mut Command) -> Result<Value> {
    command.args(["metadata", "--format-version", "1", "--no-deps"]);
    let output = command.output().with_context(|| format!("{} could not be started", shown(command)))?;
    if !output.status.success() {
        bail!("{} failed: {}", shown(command), String::from_utf8_lossy(&output.stderr).trim_end());
    }
    serde_json::from_slice(&output.stdout).context("cargo metadata is no JSON")
}

fn members(metadata: &Value) -> impl Iterator<Item = &Value> {
    // `--no-deps` lists the workspace's members and nothing else.
    metadata["packages"].as_array().into_iter().flatten()
}

fn target(metadata: &Value) -> Result<PathBuf> {
    text(metadata, "target_directory").map(PathBuf::from)
}

fn text<'a>(value: &'a Value, key: &str) -> Result<&'a str> {
    value[key].as_str().with_context(|| format!("cargo metadata without `{key}`"))
}

fn read(package: &Value, shipped: bool) -> Result<Option<Crate>> {
    let is_cdylib = |t: &&Value| t["crate_types"].as_array().is_some_and(|k| k.iter().any(|k| k == "cdylib"));
    let Some(library) = package["targets"].as_array().into_iter().flatten().find(is_cdylib) else { return Ok(None) };
    let logger = package["metadata"]["latchwork"]["logger"].as_bool().unwrap_or(false);
    let package = text(package, "name")?;
    Ok(Some(Crate {
        name: package.strip_prefix("latchwork-").unwrap_or(package).to_owned(),
        package: package.to_owned(),
        module: format!("{}.wasm", text(library, "name")?.replace('-', "_")),
        shipped,
        example: false,
        logger,
    }))
}
