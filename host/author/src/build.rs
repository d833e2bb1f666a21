//! `latchwork build`: the language's own tool, then the component.

use crate::abi::Abi;
use crate::error::AuthorError;
use crate::lang::{Block, Language};
use crate::manifest::{Manifest, Prepare, Step};
use crate::{component, project, tools, wit};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// npm's list of packages.
const PACKAGES: &str = "package.json";

/// A component that was built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Built {
    /// The file.
    pub path: PathBuf,
    /// Its size, bytes.
    pub bytes: usize,
    /// Interfaces with functions that it imports.
    pub imports: Vec<String>,
    /// The class that it exports.
    pub class: String,
}

/// Builds the project of a folder; `say` is told each command before it runs.
///
/// # Errors
/// No project, a tool that is missing or fails, a module that does not fit the class.
pub fn build(folder: &Path, say: &mut dyn FnMut(&str)) -> Result<Built, AuthorError> {
    let manifest = Manifest::read(folder)?;
    let (resolve, world, class) = wit::of_project(folder, manifest.class.as_deref())?;
    manifest.language.refuses(&class)?;
    let block = Block { name: manifest.name.clone(), abi: Abi::of(&class), class };
    for file in manifest.language.generated(&block) {
        // An unchanged file keeps its time: the language's own tool may have nothing to do.
        if std::fs::read_to_string(folder.join(&file.path)).is_ok_and(|old| old == file.text) {
            continue;
        }
        project::write(folder, &file)?;
    }
    let Step { command, output, env, prepare } = &manifest.build;
    if let Some(prepare) = prepare
        && !is_prepared(folder, prepare)
    {
        run(folder, &prepare.command, &BTreeMap::new(), manifest.language, say)?;
        // A tool that finds nothing to do may leave the file as old as it was.
        if let Ok(made) = std::fs::File::open(folder.join(&prepare.makes)) {
            let _ = made.set_modified(std::time::SystemTime::now());
        }
    }
    let output = folder.join(output);
    if let Some(parent) = output.parent() {
        std::fs::create_dir_all(parent).map_err(AuthorError::file(parent))?;
    }
    // What an earlier build left is not taken for the result of this one.
    match std::fs::remove_file(&output) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(AuthorError::file(&output)(e)),
        _ => {}
    }
    run(folder, command, env, manifest.language, say)?;
    let made = std::fs::read(&output).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => {
            AuthorError::NoOutput { command: manifest.build.shown(), output: output.clone() }
        }
        _ => AuthorError::File { path: output.clone(), source: e },
    })?;
    let failed = |e: anyhow::Error| AuthorError::Component { module: output.clone(), why: format!("{e:#}") };
    let bytes = component::make(&made, &resolve, world, &block.class).map_err(failed)?;
    let imports = component::imports(&bytes, &block.class).map_err(failed)?;
    let path = folder.join(format!("{}.wasm", manifest.name));
    write_whole(&path, &bytes)?;
    Ok(Built { path, bytes: bytes.len(), imports, class: block.class.id })
}

/// The component that an earlier build of the project in this folder has made.
pub fn built_before(folder: &Path) -> Option<PathBuf> {
    let manifest = Manifest::read(folder).ok()?;
    Some(folder.join(format!("{}.wasm", manifest.name))).filter(|path| path.exists())
}

/// What it makes is there, and not older than the list of packages.
fn is_prepared(folder: &Path, prepare: &Prepare) -> bool {
    let time = |path: &Path| std::fs::metadata(folder.join(path)).and_then(|m| m.modified()).ok();
    match (time(&prepare.makes), time(Path::new(PACKAGES))) {
        (None, _) => false,
        (Some(made), list) => list.is_none_or(|list| list <= made),
    }
}

fn run(
    folder: &Path,
    command: &[String],
    env: &BTreeMap<String, String>,
    language: Language,
    say: &mut dyn FnMut(&str),
) -> Result<(), AuthorError> {
    let words = tools::resolve(command, language)?;
    let shown = words.join(" ");
    say(&shown);
    let Some((program, arguments)) = words.split_first() else { return Ok(()) };
    let mut tool = Command::new(program);
    tool.args(arguments).envs(env).current_dir(folder);
    // What it says is no part of what `latchwork build --json` says.
    tool.stdout(std::io::stderr());
    let status = tool.status().map_err(AuthorError::file(program))?;
    if status.success() {
        return Ok(());
    }
    Err(AuthorError::Failed { command: shown, status: status.code(), packages: folder.join(PACKAGES).exists() })
}

/// Beside it first: whoever reads the file, a running plant perhaps, never sees half of it.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), AuthorError> {
    if std::fs::read(path).is_ok_and(|old| old == bytes) {
        return Ok(());
    }
    let draft = path.with_extension("wasm.new");
    std::fs::write(&draft, bytes).and_then(|()| std::fs::rename(&draft, path)).map_err(AuthorError::file(path))
}
