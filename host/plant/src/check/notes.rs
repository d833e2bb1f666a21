//! What can be said only of a model as a whole: circles of wires, and reads of the previous scan.

use super::Draft;
use crate::file::PlantFile;
use crate::model::{Input, Model, TagRef};
use latchwork_schema::{Checker, Finding, Span};
use std::collections::HashSet;

/// The tag that a tag merely repeats, if it does.
fn repeats(model: &Model, tag: TagRef) -> Option<TagRef> {
    match tag {
        TagRef::Input { block, port } => match &model.blocks[block].inputs[port] {
            Input::Wire(wire) => Some(wire.tag),
            _ => None,
        },
        TagRef::Point { driver, point } => model.drivers[driver].sources[point].map(|w| w.tag),
        _ => None,
    }
}

/// Wires that end in themselves: an input that reads an input that reads it, a point that shows itself.
pub(super) fn circles(checker: &mut Checker, model: &Model, file: &PlantFile, drafts: &[Draft<'_>]) {
    let inputs = drafts.iter().enumerate().flat_map(|(block, d)| {
        let ports = &model.blocks[block].class.inputs;
        d.entry.inputs.iter().filter_map(move |a| {
            let port = ports.iter().position(|p| p.path == a.path)?;
            Some((TagRef::Input { block, port }, &a.span))
        })
    });
    let points = model.drivers.iter().enumerate().flat_map(|(driver, d)| {
        let spans = file.drivers.iter().find(|e| e.name == d.config.name).map(|e| &e.points);
        d.config.points.iter().enumerate().filter_map(move |(point, config)| {
            let entry = spans?.iter().find(|p| p.name == config.name)?;
            Some((TagRef::Point { driver, point }, &entry.key))
        })
    });
    let starts: Vec<(TagRef, &Span)> = inputs.chain(points).collect();
    let mut told = HashSet::new();
    for (start, span) in starts {
        let mut path = vec![start];
        while let Some(next) = path.last().and_then(|t| repeats(model, *t)) {
            if next == start {
                if path.iter().all(|t| told.insert(*t)) {
                    let names: Vec<_> =
                        path.iter().chain([&start]).map(|t| format!("`{}`", model.tag_name(*t))).collect();
                    let finding = Finding::error(span, format!("a circle of wires: {}", names.join(" reads ")));
                    checker.add(finding.help("somewhere in it an output of a block must come in between"));
                }
                break;
            }
            if path.contains(&next) {
                break;
            }
            path.push(next);
        }
    }
}

/// Inputs that see the previous scan, because their source comes later in the same lane.
pub(super) fn order(checker: &mut Checker, model: &Model, drafts: &[Draft<'_>]) {
    for (block, draft) in drafts.iter().enumerate() {
        let b = &model.blocks[block];
        for a in &draft.entry.inputs {
            let Some(port) = b.class.inputs.iter().position(|p| p.path == a.path) else { continue };
            let mut tag = TagRef::Input { block, port };
            let mut steps = 0;
            while let Some(next) = repeats(model, tag) {
                tag = next;
                steps += 1;
                // A circle is an error of its own.
                if steps > model.blocks.len() + model.drivers.len() + 1 {
                    break;
                }
            }
            let (TagRef::Output { block: source, .. } | TagRef::Alarm { block: source, .. }) = tag else { continue };
            if source > block && model.blocks[source].lane == b.lane && !b.sim && !model.blocks[source].sim {
                let message = format!(
                    "`{}.inputs.{}` reads `{}` of the previous scan: block `{}` comes later in lane `{}`",
                    b.name,
                    a.path,
                    model.tag_name(tag),
                    model.blocks[source].name,
                    model.lanes[b.lane].name
                );
                let help = format!(
                    "put block `{}` before `{}` to read the value of the same scan",
                    model.blocks[source].name, b.name
                );
                checker.add(Finding::note(&a.span, message).help(help));
            }
        }
    }
}
