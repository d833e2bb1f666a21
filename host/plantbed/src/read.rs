//! From the text of a test file to the cases of a plant, with everything that is wrong with it.

use crate::keys;
use crate::model::{Case, Input, PlantTest};
use crate::operations::{inputs, settings};
use crate::steps::Steps;
use crate::subject::{Subject, load};
use crate::tags::Tags;
use latchwork_block::Engine;
use latchwork_schema::{Checker, Finding, Span, Values};
use latchwork_testbed::case::Options;
use latchwork_testbed::case::kit::{Finder, Place, cases, folders, get, rows, table, tables, tolerance};
use std::path::{Path, PathBuf};
use toml::de::DeTable;

/// What all cases of a file share.
pub(crate) struct Common<'a> {
    pub(crate) place: Place<'a>,
    pub(crate) finder: Finder<'a>,
    pub(crate) subject: Option<Subject>,
    /// Period of the first cyclic lane, ns.
    pub(crate) every: u64,
    /// Scans of all lanes in a second.
    pub(crate) scans: u64,
}

pub(crate) fn read<'a>(
    checker: &mut Checker,
    root: &'a DeTable<'a>,
    text: &'a str,
    path: &Path,
    engine: &'a Engine,
    options: &Options,
) -> (Option<PlantTest>, Vec<PathBuf>) {
    let start = 0..text.find('\n').unwrap_or(text.len());
    let other = get(root, "component");
    let own = ["case", "inputs", "settings", "component"];
    let own = if other.is_some() { &own[..] } else { &own[..3] };
    let values = table(checker, &keys::FILE, root, &start, own);
    if let Some(entry) = other {
        let finding = Finding::error(&entry.key_span, "a test file has either a `component` or a `plant`");
        checker.add(finding.help("what else the component should do belongs into a file of its own"));
    }
    let mut files = Vec::new();
    let mut common = Common {
        place: Place::new(path, text),
        finder: Finder::new(engine, path, folders(&values), &options.folders),
        subject: None,
        every: 0,
        scans: 0,
    };
    if let Some(name) = values.text("plant") {
        let plant = common.place.base.join(name);
        let sim = values.bool("sim").unwrap_or(true);
        common.subject = load(checker, &plant, sim, engine, &options.folders, &values.span_of("plant"), &mut files);
    }
    if let Some(subject) = &common.subject {
        let cyclic = subject.model.lanes.iter().find(|l| l.interrupt.is_none());
        common.every = cyclic.map_or(0, |l| l.every);
        common.scans = subject.model.lanes.iter().filter_map(|l| 1_000_000_000u64.checked_div(l.every)).sum();
    }
    let tags = common.subject.as_ref().map(|s| &s.tags);
    let shared = Start::read(checker, tags, root, &values, &Start::default());
    let read =
        |checker: &mut Checker, item: &'a DeTable<'a>, span: &Span| case(checker, &mut common, &shared, item, span);
    let cases = cases(checker, root, &start, |case: &Case| &case.name, read);
    files.extend(common.finder.tried);
    files.extend(common.place.files);
    let file = common.subject.map(|s| PlantTest { path: path.into(), model: s.model, cases, engine: engine.clone() });
    (file, files)
}

/// What a case begins with; each level adds to the one above.
#[derive(Clone, Default)]
struct Start {
    tolerance: f64,
    inputs: Vec<Input>,
    settings: Vec<(String, u64)>,
}

impl Start {
    fn read(checker: &mut Checker, tags: Option<&Tags>, table: &DeTable<'_>, values: &Values, above: &Self) -> Self {
        let mut start = above.clone();
        if let Some(given) = values.constant("tolerance") {
            let read = tolerance(checker, "tolerance", given, &values.span_of("tolerance"));
            start.tolerance = read.unwrap_or(start.tolerance);
        }
        if let Some(tags) = tags {
            start.inputs.extend(inputs(checker, tags, table));
            start.settings.extend(settings(checker, tags, table));
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
    let values = table(checker, &keys::CASE, item, span, &["inputs", "settings", "step", "table"]);
    let tags = common.subject.as_ref().map(|s| &s.tags);
    let start = Start::read(checker, tags, item, &values, shared);
    let before = checker.findings.len();
    let mut steps = Steps::new(common, start.tolerance);
    if let Some(entry) = get(item, "step") {
        for (step, span) in tables(checker, &entry, "[[case.step]]") {
            steps.step(checker, common, step, &span);
        }
    }
    if let Some(entry) = get(item, "table") {
        rows(checker, &mut common.place, &entry, &mut steps);
    }
    // Steps that were told and are wrong have their findings.
    if steps.list.is_empty() && checker.findings.len() == before {
        checker.add(Finding::error(span, "the case tests nothing").help("add a [[case.step]] or a [[case.table]]"));
    }
    for input in &start.inputs {
        steps.watch(&input.tag);
    }
    let (name, line) = (values.text("name")?.to_owned(), common.place.line(span));
    let (inputs, settings) = (start.inputs, start.settings);
    Some(Case { name, line, watched: steps.watched, inputs, settings, steps: steps.list })
}
