//! `block.toml`: what `latchwork build` needs to know of a project.

use crate::error::AuthorError;
use crate::lang::Language;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Component, Path, PathBuf};

/// Its name.
pub(crate) const FILE: &str = "block.toml";

/// A project as its manifest describes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Manifest {
    /// Name of the block, and of its component.
    pub name: String,
    /// Language.
    pub language: Language,
    /// Device class with its version, where the world exports several.
    pub class: Option<String>,
    /// How it is built.
    pub build: Step,
}

/// The call of a language's own tool.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Program and arguments, run in the project's folder.
    pub command: Vec<String>,
    /// What it writes: a core module, or a component.
    pub output: PathBuf,
    /// Environment variables that it needs.
    #[serde(default)]
    pub env: BTreeMap<String, String>,
    /// What must be done once before.
    #[serde(default)]
    pub prepare: Option<Prepare>,
}

/// A command that is run when what it makes is not there, or older than the list of packages.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prepare {
    /// Program and arguments.
    pub command: Vec<String>,
    /// A file or folder.
    pub makes: PathBuf,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    name: String,
    lang: String,
    class: Option<String>,
    build: Step,
}

impl Manifest {
    /// Reads the manifest of a project's folder.
    ///
    /// # Errors
    /// There is none, or it is not right: what, and where.
    pub fn read(folder: &Path) -> Result<Self, AuthorError> {
        let path = folder.join(FILE);
        let text = std::fs::read_to_string(&path).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => AuthorError::NoProject(folder.to_path_buf()),
            _ => AuthorError::File { path: path.clone(), source: e },
        })?;
        let wrong = |why: String| AuthorError::Manifest { path: path.clone(), why };
        let raw: Raw = toml::from_str(&text).map_err(|e| wrong(e.to_string().trim_end().to_owned()))?;
        let language = Language::parse(&raw.lang).map_err(|e| wrong(e.to_string()))?;
        let programs = [Some(&raw.build.command), raw.build.prepare.as_ref().map(|p| &p.command)];
        if programs.into_iter().flatten().any(Vec::is_empty) {
            return Err(wrong("a `command` is empty; expected a program and its arguments".into()));
        }
        let output = &raw.build.output;
        let inside = output.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if !inside || output.extension().is_none_or(|e| e != "wasm") {
            return Err(wrong(format!(
                "`output` is {:?}; expected a path inside the project that ends in .wasm: what is there is removed before each build",
                output.display().to_string()
            )));
        }
        if !crate::names::is_name(&raw.name) {
            return Err(wrong(AuthorError::Name(raw.name).to_string()));
        }
        Ok(Self { name: raw.name, language, class: raw.class, build: raw.build })
    }

    /// The manifest as a file.
    pub(crate) fn text(&self) -> String {
        let step = &self.build;
        let mut text = format!(
            "# What `latchwork build` does here; the class is what wit/world.wit exports.\nname = {:?}\nlang = {:?}\n",
            self.name,
            self.language.name(),
        );
        // A String takes whatever is written.
        if let Some(class) = &self.class {
            let _ = writeln!(text, "class = {class:?}");
        }
        text += "\n[build]\n";
        let _ = writeln!(text, "command = {}", list(&step.command));
        if !step.env.is_empty() {
            let pairs: Vec<String> = step.env.iter().map(|(k, v)| format!("{k} = {v:?}")).collect();
            let _ = writeln!(text, "env = {{ {} }}", pairs.join(", "));
        }
        let _ = writeln!(text, "output = {:?}", step.output.display().to_string());
        if let Some(prepare) = &step.prepare {
            let makes = prepare.makes.display().to_string();
            let _ = writeln!(text, "prepare = {{ command = {}, makes = {makes:?} }}", list(&prepare.command));
        }
        text
    }
}

/// A list over as many lines as it takes.
fn list(words: &[String]) -> String {
    let quoted: Vec<String> = words.iter().map(|w| format!("{w:?}")).collect();
    let line = format!("[{}]", quoted.join(", "));
    if line.len() <= 100 { line } else { format!("[\n    {},\n]", quoted.join(",\n    ")) }
}

impl Step {
    /// The command as a user would type it.
    pub fn shown(&self) -> String {
        let quote = |w: &String| if w.contains(' ') { format!("'{w}'") } else { w.clone() };
        let env = self.env.iter().map(|(k, v)| format!("{k}={v}"));
        env.chain(self.command.iter().map(quote)).collect::<Vec<_>>().join(" ")
    }
}
