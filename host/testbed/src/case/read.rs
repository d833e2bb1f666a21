//! From the text of a test file to cases, with everything that is wrong with it.

use super::keys;
use super::locate::Finder;
use super::model::{Case, SetCell, Subject, TestFile};
use super::ports::{inputs, retained, settings};
use super::steps::Steps;
use super::table::{Place, rows};
use super::tables::{cases, folders, get, group, table, tables};
use super::values::tolerance;
use latchwork_block::Engine;
use latchwork_schema::check::parse;
use latchwork_schema::{Checker, Finding, Span, Values, findings_json, render};
use std::path::{Path, PathBuf};
use toml::de::DeTable;

/// Period when none is given, ns.
const EVERY: u64 = 10_000_000;

/// What the caller knows about where things are.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Folders of components, searched before those of the file, and of the plant that it names.
    pub folders: Vec<PathBuf>,
}

/// A test file with its findings.
#[derive(Debug)]
pub struct Checked {
    /// Where it is.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
    /// What is wrong with it.
    pub findings: Vec<Finding>,
    /// Files that it names, whether they are there or not: components, tables. A change of one changes the tests.
    pub files: Vec<PathBuf>,
    /// The tests; `None` when there is any finding.
    pub file: Option<TestFile>,
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
}

/// Reads and checks a test file; all its components are loaded and compiled.
pub fn check_file(path: &Path, engine: &Engine, options: &Options) -> Checked {
    match std::fs::read_to_string(path) {
        Ok(text) => check_text(path, text, engine, options),
        Err(error) => {
            let message = format!("the file cannot be read: {error}");
            let finding = Finding { span: None, ..Finding::error(&(0..0), message) };
            let finding = finding.help("expected a test file, as in `latchwork test ton.test.toml`");
            Checked { path: path.into(), text: String::new(), findings: vec![finding], files: Vec::new(), file: None }
        }
    }
}

/// The same with the text at hand; `path` says where relative names begin.
pub fn check_text(path: &Path, text: String, engine: &Engine, options: &Options) -> Checked {
    let (table, syntax) = parse(&text);
    let mut checker = Checker { findings: syntax, ..Checker::default() };
    let (file, files) = read(&mut checker, table.get_ref(), &text, path, engine, options);
    let mut findings = checker.findings;
    findings.sort_by_key(|f| f.span.as_ref().map(|s| s.start));
    let file = file.filter(|_| findings.is_empty());
    Checked { path: path.into(), text, findings, files, file }
}

/// What all cases of a file share.
pub(super) struct Common<'a> {
    pub(super) place: Place<'a>,
    pub(super) finder: Finder<'a>,
    pub(super) subject: Option<Subject>,
}

fn read<'a>(
    checker: &mut Checker,
    root: &'a DeTable<'a>,
    text: &'a str,
    path: &Path,
    engine: &'a Engine,
    options: &Options,
) -> (Option<TestFile>, Vec<PathBuf>) {
    let start = 0..text.find('\n').unwrap_or(text.len());
    let values = table(checker, &keys::FILE, root, &start, &["case", "settings", "inputs"]);
    let mut common = Common {
        place: Place::new(path, text),
        finder: Finder::new(engine, path, folders(&values), &options.folders),
        subject: None,
    };
    if let Some(name) = values.text("component") {
        common.subject = common.finder.subject(checker, name, values.text("class"), &values.span_of("component"));
    }
    let shared = Start::read(checker, common.subject.as_ref(), root, &values, &Start::default());
    let read =
        |checker: &mut Checker, item: &'a DeTable<'a>, span: &Span| case(checker, &mut common, &shared, item, span);
    let cases = cases(checker, root, &start, |case: &Case| &case.name, read);
    let mut files = common.finder.tried;
    files.extend(common.place.files);
    let file = common.subject.map(|subject| TestFile {
        path: path.into(),
        subject,
        cases,
        budget: values.duration("budget").unwrap_or(1_000_000_000),
        memory: values.size("memory").unwrap_or(4 << 20),
    });
    (file, files)
}

/// What a case begins with; each level adds to the one above.
#[derive(Clone, Default)]
struct Start {
    every: Option<u64>,
    tolerance: f64,
    settings: Vec<Option<u64>>,
    inputs: Vec<SetCell>,
}

impl Start {
    fn read(
        checker: &mut Checker,
        subject: Option<&Subject>,
        table: &DeTable<'_>,
        values: &Values,
        above: &Self,
    ) -> Self {
        let mut start = above.clone();
        start.every = values.duration("every").or(above.every);
        if let Some(given) = values.constant("tolerance") {
            let read = tolerance(checker, "tolerance", given, &values.span_of("tolerance"));
            start.tolerance = read.unwrap_or(start.tolerance);
        }
        let Some(subject) = subject else { return start };
        start.settings.resize(subject.class.settings.len(), None);
        if let Some(given) = group(checker, table, "settings") {
            let settings = settings(subject);
            for said in settings.said(checker, given) {
                start.settings[said.port] = settings.constant(checker, &said);
            }
        }
        if let Some(given) = group(checker, table, "inputs") {
            let inputs = inputs(subject);
            for said in inputs.said(checker, given) {
                start.inputs.extend(inputs.input(checker, &said));
            }
        }
        start
    }
}

fn case(
    checker: &mut Checker,
    common: &mut Common<'_>,
    shared: &Start,
    item: &DeTable<'_>,
    span: &Span,
) -> Option<Case> {
    const OWN: [&str; 5] = ["settings", "inputs", "state", "step", "table"];
    let values = table(checker, &keys::CASE, item, span, &OWN);
    let start = Start::read(checker, common.subject.as_ref(), item, &values, shared);
    let every = start.every.unwrap_or(EVERY);
    let subject = common.subject.clone();
    let mut state = None;
    if let Some(subject) = &subject
        && let Some(given) = group(checker, item, "state")
    {
        let fields = retained(subject);
        let mut cells = vec![None; fields.ports.len()];
        for said in fields.said(checker, given) {
            cells[said.port] = fields.constant(checker, &said);
        }
        state = Some(cells);
    }
    let before = checker.findings.len();
    let mut steps = Steps::new(every, start.tolerance, subject);
    if let Some(entry) = get(item, "step") {
        for (step, span) in tables(checker, &entry, "[[case.step]]") {
            steps.step(checker, common, step, &span);
        }
    }
    if let Some(entry) = get(item, "table") {
        rows(checker, &mut common.place, &entry, &mut steps);
    }
    let expect = values.table("expect");
    let word = |key| expect.and_then(|e| e.text(key)).map(str::to_owned);
    let (refused, fault) = (word("refused"), word("fault"));
    let steps = steps.list;
    if (refused.is_some() || fault.is_some()) && !steps.is_empty() {
        let finding = Finding::error(&values.span_of("expect"), "a case whose start fails has no steps");
        checker.add(finding.help("expect it in a step, or leave the steps out"));
    }
    // Steps that were told and are wrong have their findings.
    let told = checker.findings.len() > before;
    if steps.is_empty() && !told && refused.is_none() && fault.is_none() {
        checker.add(Finding::error(span, "the case tests nothing").help("add a [[case.step]] or a [[case.table]]"));
    }
    Some(Case {
        name: values.text("name")?.to_owned(),
        line: common.place.line(span),
        every,
        start: values.duration("start").unwrap_or(0),
        first: values.bool("first"),
        elapsed: values.duration("elapsed").unwrap_or(0),
        settings: start.settings,
        inputs: start.inputs,
        state,
        refused,
        fault,
        steps,
    })
}
