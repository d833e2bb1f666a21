//! Finds and loads the components that a test file names.

use super::model::Subject;
use latchwork_block::{Engine, LoadError};
use latchwork_image::nearest;
use latchwork_schema::{Checker, Finding, Span};
use std::path::{Path, PathBuf};

/// Where components are looked for.
pub struct Finder<'a> {
    engine: &'a Engine,
    /// Folder of the test file.
    base: PathBuf,
    folders: Vec<PathBuf>,
    /// Every file that was looked for, for those who wait for a change.
    pub tried: Vec<PathBuf>,
}

impl<'a> Finder<'a> {
    /// `given`: the folders that the file names, as it writes them; `more`: those of the caller, which come first.
    pub fn new(engine: &'a Engine, file: &Path, given: Option<Vec<String>>, more: &[PathBuf]) -> Self {
        let base = file.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut folders = more.to_vec();
        match given {
            Some(list) => folders.extend(list.iter().map(|f| base.join(f))),
            None => {
                folders.push(base.clone());
                folders.extend(built(&base));
            }
        }
        Self { engine, base, folders, tried: Vec::new() }
    }

    /// Loads a component and the class of it that is tested, or says what is in the way.
    pub fn subject(&mut self, checker: &mut Checker, name: &str, class: Option<&str>, span: &Span) -> Option<Subject> {
        let help = "`class` is one that the component exports; leave it out where that is only one";
        self.load(checker, name, class, span, help)
    }

    /// Loads another version of what runs: a component that exports the same class, in whatever version.
    pub fn version(&mut self, checker: &mut Checker, name: &str, class: Option<&str>, span: &Span) -> Option<Subject> {
        let bare = |name: &str| name.split_once('@').map_or(name, |(name, _)| name).to_owned();
        // Where the old one is not known, whatever the new one exports will do for the checks that follow.
        let help = "a version that takes over is of the class of the one before";
        self.load(checker, name, class.map(bare).as_deref(), span, help)
    }

    /// With `help` where the component is of another class.
    fn load(
        &mut self,
        checker: &mut Checker,
        name: &str,
        class: Option<&str>,
        span: &Span,
        help: &str,
    ) -> Option<Subject> {
        let path = match self.path(name) {
            Ok(path) => path,
            Err(finding) => {
                checker.add(Finding { span: Some(span.clone()), ..finding });
                return None;
            }
        };
        let loaded = self.engine.load_file(&path).and_then(|component| {
            let class = component.class(class)?;
            let template = component.template(&class)?;
            Ok(Subject { component, class, template })
        });
        let wrong = |error: LoadError| {
            let help = matches!(error, LoadError::UnknownClass { .. }).then(|| help.to_owned());
            Finding::error(span, format!("{}: {error}", path.display())).maybe_help(help)
        };
        loaded.map_err(|error| checker.add(wrong(error))).ok()
    }

    /// The file of a component, or what is in the way.
    ///
    /// # Errors
    /// A finding without a place: there is no such file.
    pub fn path(&mut self, name: &str) -> Result<PathBuf, Finding> {
        let error = |message| Finding::error(&(0..0), message);
        if name.ends_with(".wasm") {
            let path = self.base.join(name);
            self.tried.push(path.clone());
            let missing = || {
                let finding = error(format!("there is no file {}", path.display()));
                finding.help("the path begins at the folder of the test file; a name without .wasm is looked for in `components`")
            };
            return if path.is_file() { Ok(path) } else { Err(missing()) };
        }
        let file = format!("{name}.wasm");
        for path in self.folders.iter().map(|f| f.join(&file)) {
            self.tried.push(path.clone());
            if path.is_file() {
                return Ok(path);
            }
        }
        let list: Vec<_> = self.folders.iter().map(|f| shown(f)).collect();
        let finding = error(format!("there is no component `{name}`; searched in {}", list.join(", ")));
        let there = self.there();
        Err(match nearest(name, there.iter().map(String::as_str)) {
            Some(near) => finding.help(format!("did you mean \"{near}\"?")),
            None if there.is_empty() => finding.help(
                "no folder holds any component; build it first, or write `components = [\"FOLDER\"]` or a path that ends in .wasm",
            ),
            None => finding.help("write `components = [\"FOLDER\"]` with the folder it is built to, or a path that ends in .wasm"),
        })
    }

    fn there(&self) -> Vec<String> {
        let files = self.folders.iter().filter_map(|f| std::fs::read_dir(f).ok()).flatten().flatten();
        let names = files.filter_map(|f| f.file_name().into_string().ok());
        names.filter_map(|n| n.strip_suffix(".wasm").map(str::to_owned)).collect()
    }
}

/// The build folder's components, of the nearest folder above that has any.
pub(crate) fn built(base: &Path) -> Vec<PathBuf> {
    let base = std::fs::canonicalize(if base.as_os_str().is_empty() { Path::new(".") } else { base });
    let Ok(base) = base else { return Vec::new() };
    let target = base.ancestors().map(|a| a.join("target")).find(|t| t.join("components").is_dir());
    target.map(|t| vec![t.join("components"), t.join("test-components")]).unwrap_or_default()
}

fn shown(folder: &Path) -> String {
    if folder.as_os_str().is_empty() { ".".into() } else { folder.display().to_string() }
}
