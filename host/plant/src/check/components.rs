//! Finding and loading the components that blocks name.

use crate::file::{BlockEntry, PlantFile};
use latchwork_block::{Class, Component, Engine};
use latchwork_image::nearest;
use latchwork_schema::{Checker, Finding, Span, Value};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Loads each component once.
pub(super) struct Loader<'a> {
    engine: &'a Engine,
    /// That of the plant file.
    pub(super) folder: &'a Path,
    /// Those of the caller, searched first.
    before: &'a [PathBuf],
    /// Those of the file.
    folders: Vec<(PathBuf, Span)>,
    /// The list of folders itself is wrong or its table missing: nothing can be said about what is not found.
    unread: bool,
    /// By name; `None` for one that has been told to be broken or missing.
    known: HashMap<String, Option<Component>>,
    /// Every file that was looked for.
    pub(super) tried: Vec<PathBuf>,
}

/// The folders of components that a plant file in `folder` names.
pub(crate) fn folders(file: &PlantFile, folder: &Path) -> Vec<(PathBuf, Span)> {
    let Some(Value::List(list)) = file.plant.get("components") else { return Vec::new() };
    let text =
        |(v, span): &(Value, Span)| if let Value::Text(t) = v { Some((folder.join(t), span.clone())) } else { None };
    list.iter().filter_map(text).collect()
}

impl<'a> Loader<'a> {
    pub(super) fn new(engine: &'a Engine, folder: &'a Path, before: &'a [PathBuf], file: &PlantFile) -> Self {
        let folders = folders(file, folder);
        let given =
            file.plant.get("components").is_some_and(|v| matches!(v, Value::List(l) if l.len() == folders.len()));
        let unread = file.unread.contains(&"plant") || (file.components_given && !given);
        Self { engine, folder, before, folders, unread, known: HashMap::new(), tried: Vec::new() }
    }

    /// All folders, in the order they are searched.
    pub(super) fn folders(&self) -> impl Iterator<Item = &Path> {
        self.before.iter().chain(self.folders.iter().map(|(folder, _)| folder)).map(PathBuf::as_path)
    }

    /// A note for every folder that is not there: a component may still be found in another.
    pub(super) fn folders_exist(&self, checker: &mut Checker) {
        for (folder, span) in &self.folders {
            if !folder.is_dir() {
                let finding = Finding::note(span, format!("the folder {} does not exist", folder.display()));
                checker.add(finding.help("`cargo xtask guests` builds the components that ship with Latchwork"));
            }
        }
    }

    /// The component and class of a block, or findings.
    pub(super) fn class(&mut self, checker: &mut Checker, block: &BlockEntry) -> Option<(Component, Arc<Class>)> {
        let name = block.values.text("component")?;
        let component = match self.known.get(name) {
            Some(known) => known.clone()?,
            None => {
                let loaded = self.load(checker, name, &block.values.span_of("component"));
                self.known.insert(name.to_owned(), loaded.clone());
                loaded?
            }
        };
        match component.class(block.values.text("class")) {
            Ok(class) => Some((component, class)),
            Err(error) => {
                let at = if block.values.has("class") { "class" } else { "component" };
                checker.add(Finding::error(&block.values.span_of(at), format!("component `{name}`: {error}")));
                None
            }
        }
    }

    fn load(&mut self, checker: &mut Checker, name: &str, span: &Span) -> Option<Component> {
        let path = if name.ends_with(".wasm") {
            let path = self.folder.join(name);
            self.tried.push(path.clone());
            if !path.is_file() {
                checker.add(Finding::error(span, format!("there is no file {}", path.display())));
                return None;
            }
            path
        } else {
            let file = format!("{name}.wasm");
            let candidates: Vec<_> = self.folders().map(|f| f.join(&file)).collect();
            let found = candidates.iter().position(|p| p.is_file());
            self.tried.extend_from_slice(&candidates[..found.map_or(candidates.len(), |at| at + 1)]);
            match found {
                Some(at) => candidates[at].clone(),
                None if self.unread => return None,
                None => {
                    checker.add(self.missing(name, span));
                    return None;
                }
            }
        };
        match self.engine.load_file(&path) {
            Ok(component) => Some(component),
            Err(error) => {
                checker.add(Finding::error(span, format!("{}: {error}", path.display())));
                None
            }
        }
    }

    fn missing(&self, name: &str, span: &Span) -> Finding {
        let mut there: Vec<String> = Vec::new();
        for folder in self.folders() {
            let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let names = files.filter_map(|f| f.file_name().into_string().ok());
            there.extend(names.filter_map(|n| n.strip_suffix(".wasm").map(str::to_owned)));
        }
        let list: Vec<_> = self.folders().map(|f| f.display().to_string()).collect();
        let searched = match list.len() {
            0 => "the plant names no folders".to_owned(),
            _ => format!("searched in {}", list.join(", ")),
        };
        let finding = Finding::error(span, format!("there is no component `{name}`; {searched}"));
        match nearest(name, there.iter().map(String::as_str)) {
            Some(near) => finding.help(format!("did you mean \"{near}\"?")),
            None if list.is_empty() => {
                finding.help("add `components = [\"FOLDER\"]` to [plant], or name a file that ends in .wasm")
            }
            None if there.is_empty() => finding
                .help("no folder holds any component; `cargo xtask guests` builds those that ship with Latchwork"),
            None => {
                there.sort_unstable();
                finding.help(format!("there are {}", there.join(", ")))
            }
        }
    }
}
