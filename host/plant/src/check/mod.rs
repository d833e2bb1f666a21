//! From the plant file to the checked model: every name resolved, every type agreed, every error told at once.
//!
//! ```text
//! text ─parse─► tables ─file─► entries ─► lanes, drivers, components ─► tags ─► wires, settings ─► Model
//!                 └──────────────── findings, each at its place ────────────────┘
//! ```
//!
//! An error does not end the check. What depends on something broken is passed over in silence, so that one mistake is
//! one message.

mod alarms;
mod blocks;
mod components;
mod drivers;
mod interrupts;
mod lanes;
mod notes;
mod recorder;
mod sinks;
mod supervision;
mod tags;
mod values;
mod wires;

pub(crate) use components::folders;

use crate::file;
use crate::model::Model;
use latchwork_block::Engine;
use latchwork_schema::{Checker, Finding, Severity};
use std::io::Read;
use std::path::{Path, PathBuf};

/// How to check.
#[derive(Clone, Copy, Debug, Default)]
pub struct CheckOptions {
    /// As `run --sim` runs it: every driver is replaced by `sim` points, `[sim]` counts.
    pub sim: bool,
}

/// What a check came to.
pub struct Checked {
    /// The model, if there was no error.
    pub model: Option<Model>,
    /// What was found, in the order of the file.
    pub findings: Vec<Finding>,
    /// Every file that was looked for as the component of a block, whether it is there or not: a change of one may change
    /// what is found.
    pub files: Vec<PathBuf>,
    path: PathBuf,
    text: String,
}

impl Checked {
    /// The findings for a person; with colours if asked for.
    pub fn render(&self, colours: bool) -> String {
        latchwork_schema::render(&self.findings, &self.path, &self.text, colours)
    }

    /// The findings for a script: a list of `{severity, file, line, column, message, help}`.
    pub fn json(&self) -> serde_json::Value {
        latchwork_schema::findings_json(&self.findings, &self.path, &self.text)
    }
}

/// Checks a plant file.
pub fn check_file(path: &Path, engine: &Engine, options: CheckOptions) -> Checked {
    check_file_with(path, engine, options, &[])
}

/// Checks a plant file; components are looked for in `folders` first, then in those that it names.
pub fn check_file_with(path: &Path, engine: &Engine, options: CheckOptions, folders: &[PathBuf]) -> Checked {
    match read(path) {
        Ok(text) => check(path, text, engine, options, folders),
        Err(message) => {
            let finding = Finding { severity: Severity::Error, span: None, message, help: None };
            let (findings, files, text) = (vec![finding], Vec::new(), String::new());
            Checked { model: None, findings, files, path: path.into(), text }
        }
    }
}

/// More than any plant file has; what is longer is something else, perhaps without an end.
const LONGEST: u64 = 16 << 20;

pub(crate) fn read(path: &Path) -> Result<String, String> {
    if path.is_dir() {
        return Err("this is a folder; expected a plant file, a TOML text".into());
    }
    let cannot = |error: std::io::Error| format!("the plant file cannot be read: {error}");
    let mut bytes = Vec::new();
    let file = std::fs::File::open(path).map_err(cannot)?;
    file.take(LONGEST + 1).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > LONGEST {
        return Err("this is longer than 16 MiB; expected a plant file, a TOML text".into());
    }
    String::from_utf8(bytes).map_err(|e| {
        let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        format!("line {line} holds bytes that are no UTF-8; expected a plant file, a TOML text")
    })
}

/// Checks the text of a plant file; `path` is where it stands, for messages and relative folders.
pub fn check_text(path: &Path, text: String, engine: &Engine, options: CheckOptions) -> Checked {
    check(path, text, engine, options, &[])
}

fn check(path: &Path, text: String, engine: &Engine, options: CheckOptions, folders: &[PathBuf]) -> Checked {
    let (root, syntax) = latchwork_schema::check::parse(&text);
    let mut checker = Checker { findings: syntax, ..Checker::default() };
    let (mut model, mut files) = (None, Vec::new());
    // What a broken text means is guesswork; its own errors are enough.
    if checker.findings.is_empty() {
        let file = file::read(&mut checker, root.get_ref(), &text);
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut loader = components::Loader::new(engine, folder, folders, &file);
        let model = model.insert(build(&mut checker, &file, engine, &mut loader, options));
        model.file = path.into();
        files = loader.tried;
    }
    let mut findings = checker.findings;
    findings.sort_by_key(|f| f.span.as_ref().map_or(0, |s| s.start));
    findings.dedup();
    if findings.iter().any(|f| f.severity == Severity::Error) {
        model = None;
    }
    Checked { model, findings, files, path: path.into(), text }
}

/// Everything known of a block while it is checked.
struct Draft<'a> {
    entry: &'a file::BlockEntry,
    /// Its component and class, if they are sound.
    class: Option<(latchwork_block::Component, std::sync::Arc<latchwork_block::Class>)>,
}

fn build(
    checker: &mut Checker,
    file: &file::PlantFile,
    engine: &Engine,
    loader: &mut components::Loader<'_>,
    options: CheckOptions,
) -> Model {
    let mut lanes = lanes::lanes(checker, file);
    unique_names(checker, file);
    // Without --sim the blocks of [sim] are checked for their keys alone.
    let mut chosen: Vec<_> = file.blocks.iter().filter(|b| !b.sim || options.sim).collect();
    chosen.sort_by_key(|b| b.key.start);
    loader.folders_exist(checker);
    let drafts: Vec<_> = chosen.into_iter().map(|entry| Draft { entry, class: loader.class(checker, entry) }).collect();
    let mut drivers = drivers::drivers(checker, file);
    let tags = tags::Tags::new(&lanes, &drivers, &drafts, file, options);
    let blocks = blocks::blocks(checker, &drafts, &lanes, &tags, file);
    wires::outputs(checker, &mut drivers, &tags);
    if options.sim {
        wires::feeds(checker, file, &mut drivers, &tags);
    }
    lanes::have_blocks(checker, file, &drafts);
    interrupts::resolve(checker, file, &mut lanes, &drivers, &tags, options);
    interrupts::notes(checker, file, &lanes, &drafts);
    notes::circles(checker, &blocks, &drafts, &drivers);
    notes::limits(checker, &drafts);
    let sinks = sinks::sinks(checker, file, engine, loader);
    let watchdog = lanes::watchdog(checker, file, &lanes);
    let (alarm_rules, variables) = alarms::rules(checker, file, &tags);
    let mut model = Model {
        file: Default::default(),
        name: file.plant.text("name").unwrap_or_default().to_owned(),
        lanes: lanes.into_iter().map(|l| l.lane).collect(),
        drivers: drivers.into_iter().filter_map(|d| d.driver).collect(),
        blocks: blocks.into_iter().flatten().collect(),
        sim: options.sim,
        watchdog,
        policy: file.policy.clone(),
        alarm_rules,
        variables,
        tables: supervision::tables(checker, file, &tags),
        heartbeat: supervision::heartbeat(file),
        recorder: None,
        sinks,
        journal: sinks::journal(file),
        retain_every: file.retain.duration("every").unwrap_or(crate::retain::EVERY),
    };
    model.recorder = recorder::recorder(checker, file, &model);
    // Only in a model whose indices are all right is the order of blocks that of the file.
    if !checker.findings.iter().any(|f| f.severity == Severity::Error) {
        notes::order(checker, &model, &drafts);
        sinks::note(checker, file);
        interrupts::serve(&mut model);
    }
    model
}

/// A block and a driver, or a block and a block of [sim], of one name.
fn unique_names(checker: &mut Checker, file: &file::PlantFile) {
    let mut seen: Vec<(&str, &str)> = Vec::new();
    let drivers = file.drivers.iter().map(|d| ("driver", d.name.as_str(), &d.key));
    let blocks = file.blocks.iter().map(|b| (if b.sim { "block of [sim]" } else { "block" }, b.name.as_str(), &b.key));
    for (what, name, span) in drivers.chain(blocks) {
        match seen.iter().find(|(_, n)| *n == name) {
            Some((other, _)) => {
                let message = format!("the name `{name}` is taken: there is a {other} of this name");
                checker.add(Finding::error(span, message).help("choose another name"));
            }
            None => seen.push((what, name)),
        }
    }
}
