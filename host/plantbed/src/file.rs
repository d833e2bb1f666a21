//! A test file, whichever subject it has.

use crate::model::PlantTest;
use crate::read::read;
use latchwork_block::Engine;
use latchwork_image::nearest;
use latchwork_schema::check::{entries, parse};
use latchwork_schema::{Checker, Finding, findings_json, render};
use latchwork_testbed::case::{self, CaseReport, Options, TestFile};
use std::path::{Path, PathBuf};
use toml::de::DeTable;

/// A test file with its findings.
pub struct Checked {
    /// Where it is.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
    /// What is wrong with it.
    pub findings: Vec<Finding>,
    /// Files that it names, whether they are there or not: a change of one changes the tests.
    pub files: Vec<PathBuf>,
    /// The tests; `None` when there is any finding.
    pub tests: Option<Tests>,
}

/// The cases of a file.
pub enum Tests {
    /// Of a component.
    Component(Box<TestFile>),
    /// Of a plant.
    Plant(Box<PlantTest>),
}

impl Tests {
    /// Name of what is tested: the component's or the plant's.
    pub fn name(&self) -> &str {
        match self {
            Self::Component(file) => file.subject.component.name(),
            Self::Plant(file) => &file.model.name,
        }
    }

    /// Names of the cases in the order of the file.
    pub fn cases(&self) -> Vec<&str> {
        match self {
            Self::Component(file) => file.cases.iter().map(|c| c.name.as_str()).collect(),
            Self::Plant(file) => file.cases.iter().map(|c| c.name.as_str()).collect(),
        }
    }

    /// Runs a case by its number. The engine must be ticked once in `tick` ns meanwhile.
    ///
    /// # Panics
    /// If there is no case of that number.
    pub fn run(&self, case: usize, tick: u64) -> CaseReport {
        match self {
            Self::Component(file) => file.run(&file.cases[case], tick),
            Self::Plant(file) => file.run(&file.cases[case]),
        }
    }
}

impl Checked {
    /// The findings for a person, each with its line.
    pub fn render(&self, colours: bool) -> String {
        render(&self.findings, &self.path, &self.text, colours)
    }

    /// The findings for a script.
    pub fn json(&self) -> serde_json::Value {
        findings_json(&self.findings, &self.path, &self.text)
    }

    fn of_component(checked: case::Checked) -> Self {
        let case::Checked { path, text, findings, files, file } = checked;
        Self { path, text, findings, files, tests: file.map(|file| Tests::Component(Box::new(file))) }
    }
}

/// Reads and checks a test file; all its components are loaded and compiled, its plant is assembled once.
pub fn check_file(path: &Path, engine: &Engine, options: &Options) -> Checked {
    match std::fs::read_to_string(path) {
        Ok(text) => check_text(path, text, engine, options),
        // Told by those who tell it of all files.
        Err(_) => Checked::of_component(case::check_file(path, engine, options)),
    }
}

/// The same with the text at hand; `path` says where relative names begin.
pub fn check_text(path: &Path, text: String, engine: &Engine, options: &Options) -> Checked {
    let (table, syntax) = parse(&text);
    if !of_plant(table.get_ref()) {
        return Checked::of_component(case::check_text(path, text, engine, options));
    }
    let mut checker = Checker { findings: syntax, ..Checker::default() };
    let (file, files) = read(&mut checker, table.get_ref(), &text, path, engine, options);
    let mut findings = checker.findings;
    findings.sort_by_key(|f| f.span.as_ref().map(|s| s.start));
    let tests = file.filter(|_| findings.is_empty()).map(|file| Tests::Plant(Box::new(file)));
    Checked { path: path.into(), text, findings, files, tests }
}

/// The file speaks of a plant, or means to.
fn of_plant(root: &DeTable<'_>) -> bool {
    let names: Vec<_> = entries(root).into_iter().map(|e| e.name).collect();
    let misspelt = |name: &&str| nearest(name, ["plant", "component", "components"]) == Some("plant");
    names.contains(&"plant") || (!names.contains(&"component") && names.iter().any(misspelt))
}
