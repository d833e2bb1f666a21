//! What can go wrong for an author, each with the way out.

use std::path::PathBuf;

/// Why a project was not written or not built.
#[derive(Debug, thiserror::Error)]
pub enum AuthorError {
    /// No such language, or not offered.
    #[error("no language `{found}`{suggestion} (there are: {known})")]
    Language {
        /// What was given.
        found: String,
        /// `; did you mean …?`, or empty.
        suggestion: String,
        /// All that are offered.
        known: String,
    },
    /// A name that cannot be that of a crate, a package and a file.
    #[error(
        "`{0}` cannot be the name of a block; expected lower-case letters, digits and single `-`, with a letter first, as in `feed-pump` or `pump-2`"
    )]
    Name(String),
    /// No folder of WIT.
    #[error("no folder {}; --wit takes the folder with the .wit files of your class", .0.display())]
    NoWit(PathBuf),
    /// The folder is there already.
    #[error("{} exists already; nothing was written. Choose another name, or remove it", .0.display())]
    Exists(PathBuf),
    /// No such shipped class.
    #[error(
        "no device class `{found}`{suggestion} (there are: {known}); for a class of your own, give its folder with --wit"
    )]
    UnknownClass {
        /// What was given.
        found: String,
        /// `; did you mean …?`, or empty.
        suggestion: String,
        /// All that are shipped.
        known: String,
    },
    /// The author's WIT cannot be read.
    #[error("the WIT in {} cannot be read: {why}", .folder.display())]
    Wit {
        /// The folder.
        folder: PathBuf,
        /// What the parser says, with the place.
        why: String,
    },
    /// An interface that is no device class.
    #[error("`{id}` is no device class: {why}")]
    NoClass {
        /// The interface.
        id: String,
        /// What does not fit.
        why: String,
    },
    /// A class whose names a language has no way to write.
    #[error("`{id}` cannot be written in {language}: {why}; give it another name in the WIT, or take another language")]
    Names {
        /// The class.
        id: String,
        /// The language.
        language: &'static str,
        /// Which name, and what it collides with.
        why: String,
    },
    /// A folder of WIT with no class or several.
    #[error("{} has {}", .folder.display(), which(.found))]
    WhichClass {
        /// The folder.
        folder: PathBuf,
        /// Interfaces with `execute`.
        found: Vec<String>,
    },
    /// No project here.
    #[error("no block.toml in {}; expected a folder that `latchwork new` wrote", .0.display())]
    NoProject(PathBuf),
    /// The manifest is not right.
    #[error("{}: {why}", .path.display())]
    Manifest {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A tool of the language is not installed.
    #[error("`{program}` is not installed, and {language} needs it\n{how}")]
    MissingTool {
        /// The program.
        program: String,
        /// The language.
        language: &'static str,
        /// How to get it on Debian and Raspberry Pi OS.
        how: String,
    },
    /// A tool ran and failed.
    #[error(
        "`{command}` failed{}; its messages are above. If a part of the toolchain is missing: README.md{}",
        .status.map_or_else(String::new, |s| format!(" (exit code {s})")),
        if *.packages { ", or remove node_modules, and `latchwork build` installs it anew" } else { "" }
    )]
    Failed {
        /// The command.
        command: String,
        /// Its exit code, if it ended by itself.
        status: Option<i32>,
        /// Packages of npm are part of the toolchain.
        packages: bool,
    },
    /// A tool claimed to succeed and wrote nothing.
    #[error("`{command}` succeeded and wrote no {}; `output` in block.toml says what it is to write", .output.display())]
    NoOutput {
        /// The command.
        command: String,
        /// What was expected.
        output: PathBuf,
    },
    /// The module cannot become a component of the class.
    #[error("{} does not become a component: {why}", .module.display())]
    Component {
        /// The core module.
        module: PathBuf,
        /// Why not.
        why: String,
    },
    /// A file cannot be read or written.
    #[error("{}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

impl AuthorError {
    /// An error of the system about a file.
    pub(crate) fn file(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { path, source }
    }
}

fn which(found: &[String]) -> String {
    if found.is_empty() {
        "no device class: no interface with a function `execute`".into()
    } else {
        format!("several device classes: {}; choose one with --class", found.join(", "))
    }
}
