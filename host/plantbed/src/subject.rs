//! The plant that a test file names.

use crate::tags::Tags;
use latchwork_block::Engine;
use latchwork_plant::assemble::{Options, Plant, Time, assemble};
use latchwork_plant::check::{CheckOptions, Checked, check_file_with};
use latchwork_plant::model::Model;
use latchwork_schema::{Checker, Finding, Severity, Span};
use std::path::{Path, PathBuf};

/// A plant, found right.
pub(crate) struct Subject {
    pub(crate) model: Model,
    pub(crate) tags: Tags,
}

/// Checks a plant file and assembles its plant once; `folders` are searched for its components before those that it names,
/// `files` gets all that it is made of.
pub(crate) fn load(
    checker: &mut Checker,
    path: &Path,
    sim: bool,
    engine: &Engine,
    folders: &[PathBuf],
    span: &Span,
    files: &mut Vec<PathBuf>,
) -> Option<Subject> {
    files.push(path.into());
    let checked = check_file_with(path, engine, CheckOptions { sim }, folders);
    files.extend_from_slice(&checked.files);
    let Some(model) = checked.model else {
        checker.add(wrong(&checked, path, sim, span));
        return None;
    };
    if let Some(driver) = model.drivers.iter().find(|d| !d.simulated(sim)) {
        let message = format!("driver `{}` of {} is {}", driver.config.name, path.display(), driver.kind.name);
        checker.add(Finding::error(span, message).help("leave `sim = false` out: tests run without hardware"));
        return None;
    }
    match start(&model, engine) {
        Ok(plant) => Some(Subject { tags: Tags::of(&plant), model }),
        Err(error) => {
            checker.add(Finding::error(span, format!("the plant {} does not start: {error}", path.display())));
            None
        }
    }
}

/// The same with some settings in the place of those of the plant file.
pub(crate) fn start_with(model: &Model, settings: &[(String, u64)], engine: &Engine) -> Result<Plant, String> {
    let mut model = model.clone();
    for block in &mut model.blocks {
        let own = format!("{}.settings.", block.name);
        for (path, cell) in settings.iter().filter_map(|(tag, cell)| Some((tag.strip_prefix(&own)?, cell))) {
            if let Some(port) = block.class.settings.iter().position(|p| p.path == path) {
                block.settings[port] = Some(*cell);
            }
        }
    }
    start(&model, engine)
}

/// The plant of a model, for virtual time.
pub(crate) fn start(model: &Model, engine: &Engine) -> Result<Plant, String> {
    assemble(model.clone(), engine, &Options { time: Time::Virtual, trace: None }).map_err(|e| e.to_string())
}

/// A plant file that is wrong, in one sentence.
fn wrong(checked: &Checked, path: &Path, sim: bool, span: &Span) -> Finding {
    let errors = || checked.findings.iter().zip(checked.json().as_array().cloned().unwrap_or_default());
    let errors: Vec<_> = errors().filter(|(f, _)| f.severity == Severity::Error).collect();
    let shown = path.display();
    let Some((first, at)) = errors.first() else { return Finding::error(span, format!("{shown} is wrong")) };
    // Without a place it is the file as a whole.
    let line = at.get("line").and_then(serde_json::Value::as_u64).filter(|_| first.span.is_some());
    let line = line.map(|line| format!("line {line}: ")).unwrap_or_default();
    let more = match errors.len() {
        1 => String::new(),
        n => format!("; and {} more", n - 1),
    };
    let finding = Finding::error(span, format!("the plant file {shown} is wrong: {line}{}{more}", first.message));
    if !path.is_file() {
        return finding.help("the path begins at the folder of the test file");
    }
    finding.help(format!("`latchwork check {shown}{}` shows all of it", if sim { " --sim" } else { "" }))
}
