//! Sinks, and the journal that they read.

use super::components::Loader;
use crate::file::PlantFile;
use crate::model::SinkSpec;
use latchwork_block::Engine;
use latchwork_record::journal::Options;
use latchwork_schema::{Checker, Finding};
use latchwork_sink::Config;
use std::path::Path;
use std::time::Duration;

/// Size of a journal whose plant file says nothing.
const SIZE: u64 = 4 << 30;

/// The sinks that are sound.
pub(super) fn sinks(checker: &mut Checker, file: &PlantFile, engine: &Engine, loader: &Loader<'_>) -> Vec<SinkSpec> {
    let mut sound: Vec<SinkSpec> = Vec::new();
    for entry in &file.sinks {
        let Some(kind) = entry.kind.filter(|_| entry.sound) else { continue };
        let config = Config {
            name: entry.name.clone(),
            plant: file.plant.text("name").unwrap_or_default().to_owned(),
            folder: loader.folder.to_owned(),
            components: loader.folders().map(Path::to_owned).collect(),
            cache: engine.cache_folder().map(Path::to_owned),
            journal: String::new(),
            values: entry.values.clone(),
        };
        for problem in latchwork_sink::check(&config).into_iter().chain((kind.check)(&config)) {
            let known = entry.values.has(&problem.key);
            let span = if known { entry.values.span_of(&problem.key) } else { entry.key.clone() };
            checker.add(Finding::error(&span, problem.message).maybe_help(problem.help));
        }
        let claim = (kind.claim)(&config);
        let same = |other: &&SinkSpec| claim.is_some() && (other.kind.claim)(&other.config) == claim;
        if let (Some(claim), Some(other)) = (&claim, sound.iter().find(same)) {
            let known = entry.values.has(claim.key);
            let span = if known { entry.values.span_of(claim.key) } else { entry.key.clone() };
            let (one, two, key) = (&other.config.name, &entry.name, claim.key);
            let message = format!("sinks `{one}` and `{two}` have the same `{key}`");
            let help = format!("give each a `{key}` of its own");
            checker.add(Finding::error(&span, message).maybe_help(Some(help)));
        }
        sound.push(SinkSpec { kind, config });
    }
    sound
}

/// What sinks need besides the file.
pub(super) fn note(checker: &mut Checker, file: &PlantFile) {
    let Some(first) = file.sinks.first() else { return };
    let count = file.sinks.len();
    let what = if count == 1 { "the sink works".to_owned() } else { format!("the {count} sinks work") };
    let message = format!("{what} only where records are kept: with `run --data FOLDER`");
    checker.add(Finding::note(&first.key, message));
}

/// How the journal works, if one is kept.
pub(super) fn journal(file: &PlantFile) -> Options {
    let (values, default) = (&file.journal, Options::default());
    let queue = values.integer("queue").and_then(|n| usize::try_from(n).ok());
    Options {
        within: values.duration("within").map_or(default.within, Duration::from_nanos),
        queue: queue.unwrap_or(default.queue),
        age: values.duration("age").map(Duration::from_nanos),
        size: Some(values.size("size").unwrap_or(SIZE)),
        sinks: file.sinks.iter().map(|s| s.name.clone()).collect(),
    }
}
