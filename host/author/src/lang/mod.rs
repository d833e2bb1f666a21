//! The languages: what each project consists of.
//!
//! A language is one module here with two functions: `authored`, the files an author goes on with, and `generated`, the glue
//! that `build` writes anew from the WIT. Adding one touches its module and the tables of this file.

mod assemblyscript;
mod c;
mod go;
mod javascript;
mod python;
mod rust;
mod zig;

use crate::abi::Abi;
use crate::class::{Class, Kind, Label, TypeDef};
use crate::error::AuthorError;
use crate::manifest::Step;
use crate::names::suggestion;
use std::collections::BTreeMap;

/// A language that blocks can be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Language {
    /// Rust, with wit-bindgen.
    Rust,
    /// C11, by clang.
    C,
    /// C++20 without exceptions, by clang.
    Cpp,
    /// Zig, freestanding.
    Zig,
    /// AssemblyScript, from npm.
    AssemblyScript,
    /// Python, by componentize-py.
    Python,
    /// JavaScript, by jco.
    JavaScript,
    /// TypeScript, by jco.
    TypeScript,
    /// Go, with its own compiler.
    Go,
}

impl Language {
    /// All of them, in the order in which they are offered.
    pub const ALL: [Self; 9] = [
        Self::Rust,
        Self::C,
        Self::Cpp,
        Self::Python,
        Self::JavaScript,
        Self::TypeScript,
        Self::Go,
        Self::Zig,
        Self::AssemblyScript,
    ];

    /// As `--lang` has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rust => "rust",
            Self::C => "c",
            Self::Cpp => "cpp",
            Self::Zig => "zig",
            Self::AssemblyScript => "assemblyscript",
            Self::Python => "python",
            Self::JavaScript => "javascript",
            Self::TypeScript => "typescript",
            Self::Go => "go",
        }
    }

    /// As people write it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Rust => "Rust",
            Self::C => "C",
            Self::Cpp => "C++",
            Self::Zig => "Zig",
            Self::AssemblyScript => "AssemblyScript",
            Self::Python => "Python",
            Self::JavaScript => "JavaScript",
            Self::TypeScript => "TypeScript",
            Self::Go => "Go",
        }
    }

    /// By its name.
    ///
    /// # Errors
    /// [`AuthorError::Language`] with all names, and the nearest.
    pub fn parse(name: &str) -> Result<Self, AuthorError> {
        Self::ALL.into_iter().find(|l| l.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            let meant = match name {
                "c++" | "cxx" => "cpp",
                "js" | "node" => "javascript",
                "ts" => "typescript",
                "py" => "python",
                "golang" => "go",
                "rs" => "rust",
                "as" => "assemblyscript",
                other => other,
            };
            AuthorError::Language { found: name.into(), suggestion: suggestion(meant, names), known: names.join(", ") }
        })
    }

    /// The file in which the author writes the block.
    pub fn source(self) -> &'static str {
        match self {
            Self::Rust => "src/lib.rs",
            Self::C => "block.c",
            Self::Cpp => "block.cpp",
            Self::Zig => "block.zig",
            Self::AssemblyScript => "block.ts",
            Self::Python => "app.py",
            Self::JavaScript => "block.js",
            Self::TypeScript => "block.ts",
            Self::Go => "block.go",
        }
    }

    /// Its components carry an interpreter.
    pub(crate) fn interprets(self) -> bool {
        matches!(self, Self::Python | Self::JavaScript | Self::TypeScript)
    }

    /// `memory` of a block in a plant file, where 4 MiB are not enough or leave little for the garbage of a runtime.
    pub(crate) fn memory(self) -> Option<&'static str> {
        match self {
            Self::Python => Some("32MiB"),
            Self::Go => Some("16MiB"),
            Self::JavaScript | Self::TypeScript => Some("8MiB"),
            _ => None,
        }
    }

    /// Why a class cannot be written in it, if it cannot: names that its bindings break with.
    pub(crate) fn refuses(self, class: &Class) -> Result<(), AuthorError> {
        let why = match self {
            Self::Rust => rust::refuses(class),
            Self::C | Self::Cpp => c::refuses(class),
            Self::Python => python::refuses(class),
            Self::Go => go::refuses(class),
            Self::Zig | Self::AssemblyScript | Self::JavaScript | Self::TypeScript => None,
        };
        let refused = |why| AuthorError::Names { id: class.id.clone(), language: self.title(), why };
        why.map_or(Ok(()), |why| Err(refused(why)))
    }

    /// The files an author goes on with, but those that all languages have.
    pub(crate) fn authored(self, block: &Block) -> Vec<File> {
        match self {
            Self::Rust => rust::authored(block),
            Self::C => c::authored(block, c::Dialect::C),
            Self::Cpp => c::authored(block, c::Dialect::Cpp),
            Self::Zig => zig::authored(block),
            Self::AssemblyScript => assemblyscript::authored(block),
            Self::Python => python::authored(block),
            Self::JavaScript => javascript::authored(block, javascript::Dialect::JavaScript),
            Self::TypeScript => javascript::authored(block, javascript::Dialect::TypeScript),
            Self::Go => go::authored(block),
        }
    }

    /// The glue, from the class alone.
    pub(crate) fn generated(self, block: &Block) -> Vec<File> {
        match self {
            Self::Rust => rust::generated(block),
            Self::C => c::generated(block, c::Dialect::C),
            Self::Cpp => c::generated(block, c::Dialect::Cpp),
            Self::Zig => zig::generated(block),
            Self::AssemblyScript => assemblyscript::generated(block),
            Self::Python => python::generated(block),
            Self::JavaScript => javascript::generated(block, javascript::Dialect::JavaScript),
            Self::TypeScript => javascript::generated(block, javascript::Dialect::TypeScript),
            Self::Go => go::generated(block),
        }
    }

    /// How the core module, or the component, is made.
    pub(crate) fn step(self, block: &Block) -> Step {
        match self {
            Self::Rust => rust::step(block),
            Self::C => c::step(block, c::Dialect::C),
            Self::Cpp => c::step(block, c::Dialect::Cpp),
            Self::Zig => zig::step(block),
            Self::AssemblyScript => assemblyscript::step(block),
            Self::Python => python::step(block),
            Self::JavaScript => javascript::step(block, javascript::Dialect::JavaScript),
            Self::TypeScript => javascript::step(block, javascript::Dialect::TypeScript),
            Self::Go => go::step(block),
        }
    }
}

/// A block to write files for.
#[derive(Debug)]
pub(crate) struct Block {
    pub(crate) name: String,
    pub(crate) class: Class,
    pub(crate) abi: Abi,
}

/// A file of a project.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct File {
    /// Below the project's folder.
    pub(crate) path: String,
    pub(crate) text: String,
}

impl File {
    pub(crate) fn new(path: impl Into<String>, text: impl Into<String>) -> Self {
        Self { path: path.into(), text: text.into() }
    }
}

/// What npm writes last, so that it is not there after an installation that was broken off.
const PACKAGES: &str = "node_modules/.package-lock.json";

/// A step without environment and preparation.
fn step(command: &[&str], output: String) -> Step {
    Step {
        command: command.iter().map(|w| (*w).to_owned()).collect(),
        output: output.into(),
        env: BTreeMap::new(),
        prepare: None,
    }
}

/// The first line of every generated file.
fn banner(block: &Block, slashes: &str) -> String {
    format!(
        "{slashes} The ports of {}. `latchwork build` writes this file from wit/; it is not yours to edit.\n",
        block.class.id
    )
}

/// What the block is, in a sentence.
fn tagline(class: &Class) -> &str {
    class.doc.lines().next().filter(|l| !l.is_empty()).unwrap_or(&class.name)
}

/// `inputs.level.quality`: where a leaf is, below the parameter or the part of the result that it belongs to.
fn place(path: &[String], field: &dyn Fn(&str) -> String) -> String {
    let rest = path[1..].iter().map(|part| field(part));
    std::iter::once(path[0].clone()).chain(rest).collect::<Vec<_>>().join(".")
}

/// Cases of enums and flags, each with its type.
fn labels(class: &Class) -> impl Iterator<Item = (&TypeDef, &str)> {
    class.types.iter().flat_map(|ty| {
        let labels: &[Label] = match &ty.kind {
            Kind::Flags(labels) | Kind::Enum(labels) => labels,
            Kind::Record(_) => &[],
        };
        labels.iter().map(move |label| (ty, label.name.as_str()))
    })
}

/// A comment with the names that `execute` works with: inputs, commands, alarms.
fn execute_names(
    class: &Class,
    access: &str,
    ident: &dyn Fn(&str) -> String,
    constant: &dyn Fn(&str, &str) -> String,
) -> String {
    let mut lines = Vec::new();
    if let Some(inputs) = class.inputs {
        let names = class.fields(inputs).iter().map(|f| format!("inputs{access}{}", ident(&f.name)));
        lines.push(format!("Inputs: {}", names.collect::<Vec<_>>().join(", ")));
    }
    for (title, group, ty) in [("Commands", "commands", class.commands), ("Alarms", "alarms", class.alarms)] {
        if let Some(Kind::Flags(labels)) = ty.map(|t| &class.types[t].kind) {
            let names = labels.iter().map(|l| constant(group, &l.name));
            lines.push(format!("{title}: {}", names.collect::<Vec<_>>().join(", ")));
        }
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_language_names_the_nearest_and_all() {
        let message = |name| Language::parse(name).unwrap_err().to_string();
        assert!(message("c++").starts_with("no language `c++`; did you mean `cpp`?"), "{}", message("c++"));
        assert!(message("cobol").contains("(there are: "), "{}", message("cobol"));
        for language in Language::ALL {
            assert_eq!(Language::parse(language.name()).unwrap(), language);
        }
    }
}
