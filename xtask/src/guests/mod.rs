//! Function blocks and loggers to components: `cargo xtask guests` for the project's own, `cargo xtask component` for any crate.
//!
//! ```text
//! find ──crates──► build ──core modules──► component ──bytes──► report (table, limits) and NAME.wasm
//! ```

mod build;
pub(crate) mod c;
mod component;
mod find;
mod report;

use crate::cross;
use anyhow::{Context, Result, bail};
use clap::Args;
use std::path::{Path, PathBuf};

/// Arguments of `cargo xtask guests`.
#[derive(Args, Debug, Default)]
pub(crate) struct Guests {
    /// Where all components go, instead of `components`, `test-components` and `example-components` in cargo's target folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Only these, by name (`ton`) or crate name (`latchwork-ton`)
    names: Vec<String>,
}

/// Arguments of `cargo xtask component`.
#[derive(Args, Debug)]
pub(crate) struct Component {
    /// The folder of the crate (where its Cargo.toml is)
    crate_folder: PathBuf,
    /// Where the component goes, instead of `components` in the crate's target folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Folder of the examples' blocks in cargo's target folder.
const EXAMPLES: &str = "example-components";

/// Builds the project's function blocks that `args` name, all of them if none is named.
pub(crate) fn execute(args: &Guests) -> Result<()> {
    let (all, target) = find::of_workspace()?;
    let (in_c, names): (Vec<_>, Vec<_>) = args.names.iter().cloned().partition(|name| c::is_one(name));
    if args.names.is_empty() || !in_c.is_empty() {
        let out = args.out.clone().unwrap_or_else(|| target.join(EXAMPLES));
        cross::unless_missing(c::TOOLS, || c::build(&out))?;
        if !args.names.is_empty() && names.is_empty() {
            return Ok(());
        }
    }
    let chosen = find::choose(all, &names)?;
    if chosen.is_empty() {
        bail!(
            "no function blocks found: a block is a crate of components/, examples/ or tests/guests/ with crate-type cdylib"
        );
    }
    build::need_targets(&chosen)?;
    let modules = build::workspace(&chosen, &target)?;
    write_all(&chosen, &modules, |krate| match &args.out {
        Some(out) => out.clone(),
        None if krate.example => target.join(EXAMPLES),
        None => target.join(if krate.shipped { "components" } else { "test-components" }),
    })
}

/// Builds one crate from anywhere.
pub(crate) fn execute_component(args: &Component) -> Result<()> {
    let (krate, target) = find::in_folder(&args.crate_folder)?;
    build::need_targets(std::slice::from_ref(&krate))?;
    let module = build::folder(&krate, &args.crate_folder, &target)?;
    let out = args.out.clone().unwrap_or_else(|| target.join("components"));
    write_all(&[krate], &[module], |_| out.clone())
}

fn write_all(crates: &[find::Crate], modules: &[PathBuf], out: impl Fn(&find::Crate) -> PathBuf) -> Result<()> {
    let mut facts = Vec::new();
    let mut faults = Vec::new();
    for (krate, module) in crates.iter().zip(modules) {
        let bytes = std::fs::read(module).with_context(|| format!("cargo wrote no {}", module.display()))?;
        let make = if krate.logger { component::from_component } else { component::from_module };
        let bytes = make(&bytes).with_context(|| format!("{}: no component can be made", krate.name))?;
        let fact = report::facts(krate, &bytes).with_context(|| format!("{}: the component is odd", krate.name))?;
        faults.extend(report::faults(krate, &fact));
        let folder = out(krate);
        std::fs::create_dir_all(&folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        write_if_changed(&folder.join(format!("{}.wasm", krate.name)), &bytes)?;
        facts.push(fact);
    }
    print!("{}", report::table(&facts));
    if faults.is_empty() { Ok(()) } else { bail!("{}", faults.join("\n")) }
}

/// Leaves an unchanged file alone: what depends on its time is not made again, and a running plant is not disturbed.
fn write_if_changed(path: &Path, bytes: &[u8]) -> Result<()> {
    if std::fs::read(path).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    // Beside it first: whoever reads the file never sees half of it.
    let draft = path.with_extension("wasm.new");
    std::fs::write(&draft, bytes)
        .and_then(|()| std::fs::rename(&draft, path))
        .with_context(|| format!("cannot write {}", path.display()))
}
