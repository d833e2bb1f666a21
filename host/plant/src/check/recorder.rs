//! `[recorder]`: which blocks, and how much of them.

use crate::file::PlantFile;
use crate::model::{Model, Recording};
use globset::{Glob, GlobMatcher};
use latchwork_schema::{Checker, Finding, Value};

const MEMORY: u64 = 8 << 20;
const SPILL: u64 = 64 << 20;
const KEYFRAME: u64 = 10_000_000_000;

pub(super) fn recorder(checker: &mut Checker, file: &PlantFile, model: &Model) -> Option<Recording> {
    let values = file.recorder.as_ref()?;
    let lanes: Vec<_> = model.lanes.iter().map(|l| l.name.as_str()).collect();
    let blocks: Vec<_> = model.blocks.iter().map(|b| b.name.as_str()).collect();
    let lanes = chosen(checker, values.get("lanes"), "lane", &lanes);
    let named = chosen(checker, values.get("blocks"), "block", &blocks);
    let recorded = |index: &usize| named.contains(index) || lanes.contains(&model.blocks[*index].lane);
    Some(Recording {
        blocks: (0..model.blocks.len()).filter(recorded).collect(),
        memory: values.size("memory").unwrap_or(MEMORY),
        spill: values.size("spill").unwrap_or(SPILL),
        keyframe: values.duration("keyframe").unwrap_or(KEYFRAME),
    })
}

/// Indices of the names that are meant; a word that means none is noted, because it is probably misspelt.
fn chosen(checker: &mut Checker, value: Option<&Value>, what: &str, names: &[&str]) -> Vec<usize> {
    let Some(Value::List(list)) = value else { return Vec::new() };
    let mut chosen = Vec::new();
    for (word, span) in list {
        let Value::Text(word) = word else { continue };
        let matcher: GlobMatcher = match Glob::new(word) {
            Ok(glob) => glob.compile_matcher(),
            Err(error) => {
                let message = format!("\"{word}\" is no glob of {what}s: {}", error.kind());
                checker.add(Finding::error(span, message).help("use * and ?, as in \"zone-*\""));
                continue;
            }
        };
        let before = chosen.len();
        chosen.extend((0..names.len()).filter(|n| matcher.is_match(names[*n])));
        if chosen.len() > before {
            continue;
        }
        if word.contains(['*', '?', '[', '{']) {
            checker.add(Finding::note(span, format!("no {what} matches \"{word}\"")));
        } else {
            let near = latchwork_image::nearest(word, names.iter().copied()).map(|n| format!("did you mean `{n}`?"));
            checker.add(Finding::error(span, format!("there is no {what} `{word}`")).maybe_help(near));
        }
    }
    chosen
}
