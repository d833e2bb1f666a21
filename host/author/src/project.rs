//! `latchwork new`: a folder that builds, and passes its first test.

use crate::abi::Abi;
use crate::error::AuthorError;
use crate::lang::{Block, File, Language};
use crate::manifest::{self, Manifest};
use crate::wit::Found;
use crate::{names, sample, tools, wit};
use std::path::{Path, PathBuf};

/// Which class a new block has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ClassChoice {
    /// A shipped one: `latchwork:device/motor`, or `motor`.
    Shipped(String),
    /// One of the author's own.
    Own {
        /// Folder of its WIT package.
        folder: PathBuf,
        /// Its name, where the package has several.
        class: Option<String>,
    },
}

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Project {
    /// The folder.
    pub folder: PathBuf,
    /// Its files, below the folder, the author's own first.
    pub files: Vec<String>,
    /// Class with version.
    pub class: String,
}

/// Writes the project `name` into a new folder of that name inside `parent`.
///
/// # Errors
/// A name that is none, a folder that exists, an unknown class, WIT that cannot be read or is no class, names that the language
/// cannot write. Nothing is left
/// behind then.
pub fn create(parent: &Path, name: &str, language: Language, class: &ClassChoice) -> Result<Project, AuthorError> {
    free(parent, name)?;
    let folder = parent.join(name);
    let found = match class {
        ClassChoice::Shipped(class) => wit::shipped(class, !language.interprets())?,
        ClassChoice::Own { folder, class } => wit::own(folder, class.as_deref(), !language.interprets())?,
    };
    language.refuses(&found.class)?;
    let class = found.class.id.clone();
    let files = files(name, language, found);
    // A folder that appears meanwhile is somebody else's, and stays.
    std::fs::create_dir(&folder).map_err(AuthorError::file(&folder))?;
    if let Err(e) = files.iter().try_for_each(|file| write(&folder, file)) {
        // What was begun is of no use to anybody; that it cannot be removed either adds nothing.
        let _ = std::fs::remove_dir_all(&folder);
        return Err(e);
    }
    Ok(Project { folder, files: files.into_iter().map(|f| f.path).collect(), class })
}

/// Whether a project of this name could be written there: worth knowing before anything else is asked.
///
/// # Errors
/// A name that is none, a folder that exists.
pub fn free(parent: &Path, name: &str) -> Result<(), AuthorError> {
    if !names::is_name(name) {
        return Err(AuthorError::Name(name.into()));
    }
    let folder = parent.join(name);
    if folder.symlink_metadata().is_ok() {
        return Err(AuthorError::Exists(folder));
    }
    Ok(())
}

/// Every file of a project.
fn files(name: &str, language: Language, found: Found) -> Vec<File> {
    let Found { class, files: wit } = found;
    let block = Block { name: name.into(), abi: Abi::of(&class), class };
    let manifest = Manifest { name: name.into(), language, class: None, build: language.step(&block) };
    let mut files = language.authored(&block);
    files.push(File::new(format!("{name}.test.toml"), sample::test_file(&block, language.memory())));
    files.push(File::new("README.md", readme(&block, language, &manifest)));
    files.push(File::new(manifest::FILE, manifest.text()));
    files.extend(language.generated(&block));
    files.extend(wit);
    files
}

/// Writes one file, with its folders.
pub(crate) fn write(folder: &Path, file: &File) -> Result<(), AuthorError> {
    let path = folder.join(&file.path);
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent).map_err(AuthorError::file(parent))?;
    }
    std::fs::write(&path, &file.text).map_err(AuthorError::file(&path))
}

/// Ten lines.
fn readme(block: &Block, language: Language, manifest: &Manifest) -> String {
    let name = &block.name;
    let install: Vec<String> = tools::install(language).iter().map(|l| format!("`{l}`")).collect();
    let mut alone = manifest.build.shown();
    if manifest.build.output.starts_with("build") {
        alone = format!("mkdir -p build && {alone}");
    }
    if let Some(prepare) = &manifest.build.prepare {
        alone = format!("{} && {alone}", prepare.command.join(" "));
    }
    if language == Language::Zig {
        // The package has no `zig` of its own; `latchwork build` takes either.
        alone = alone.replacen("zig ", "python-zig ", 1);
    }
    format!(
        "# {name}\n\nA block of class `{class}` in {title}; you write `{source}`.\n\n\
         - tools (Debian, Raspberry Pi OS): {install}\n\
         - build `{name}.wasm`: `latchwork build`\n\
         - test it: `latchwork test {name}.test.toml`\n\
         - look at it: `latchwork inspect {name}.wasm`\n\
         - {title}'s own part of the build: `{alone}`\n",
        class = block.class.id,
        title = language.title(),
        source = language.source(),
        install = install.join(", "),
    )
}
