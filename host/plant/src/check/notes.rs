//! What no single key is wrong about: circles of wires, reads of the previous scan, keys without effect.

use super::Draft;
use super::drivers::DriverDraft;
use crate::model::{Block, Input, Model, TagRef};
use latchwork_schema::{Checker, Finding, Span};
use std::collections::{HashMap, HashSet};

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

/// Where a tag's value finally comes from.
pub(super) fn origin(model: &Model, tag: TagRef) -> TagRef {
    let mut tag = tag;
    // A circle is an error of its own.
    for _ in 0..model.blocks.len() + model.drivers.len() + 2 {
        match repeats(model, tag) {
            Some(next) => tag = next,
            None => break,
        }
    }
    tag
}

/// Wires that end in themselves: an input that reads an input that reads it, a point that shows itself.
///
/// Works with what is sound, so that a circle is told along with everything else.
pub(super) fn circles(
    checker: &mut Checker,
    blocks: &[Option<Block>],
    drafts: &[Draft<'_>],
    drivers: &[DriverDraft<'_>],
) {
    let mut ends: HashMap<TagRef, End<'_>> = HashMap::new();
    for (index, (block, draft)) in blocks.iter().zip(drafts).enumerate() {
        let Some(block) = block else { continue };
        for a in &draft.entry.inputs {
            let Some(port) = block.class.inputs.iter().position(|p| p.path == a.path) else { continue };
            if let Input::Wire(wire) = &block.inputs[port] {
                let name = format!("{}.inputs.{}", block.name, a.path);
                ends.insert(TagRef::Input { block: index, port }, End { next: wire.tag, name, span: &a.span });
            }
        }
    }
    // Indices count the drivers that the model has.
    let sound = drivers.iter().filter_map(|d| d.driver.as_ref().map(|driver| (d, driver)));
    for (index, (draft, driver)) in sound.enumerate() {
        for (point, (config, source)) in driver.config.points.iter().zip(&driver.sources).enumerate() {
            let entry = draft.entry.points.iter().find(|p| p.name == config.name);
            let (Some(wire), Some(entry)) = (source, entry) else { continue };
            let name = format!("{}.{}", driver.config.name, config.name);
            let end = End { next: wire.tag, name, span: &entry.key };
            ends.insert(TagRef::Point { driver: index, point }, end);
        }
    }
    let mut starts: Vec<_> = ends.iter().map(|(tag, end)| (end.span.start, *tag)).collect();
    starts.sort_unstable_by_key(|(at, _)| *at);
    let mut told = HashSet::new();
    for (_, start) in starts {
        let mut path = vec![start];
        while let Some(next) = path.last().and_then(|t| ends.get(t)).map(|e| e.next) {
            if next == start && path.iter().all(|t| told.insert(*t)) {
                let names: Vec<_> = path.iter().chain([&start]).map(|t| format!("`{}`", ends[t].name)).collect();
                let message = format!("a circle of wires: {}", names.join(" reads "));
                let help = "somewhere in it an output of a block must come in between";
                checker.add(Finding::error(ends[&start].span, message).help(help));
            }
            if path.contains(&next) {
                break;
            }
            path.push(next);
        }
    }
}

/// What repeats another tag.
struct End<'a> {
    next: TagRef,
    name: String,
    span: &'a Span,
}

/// What a block's keys ask for and this version, or its class, does not give.
pub(super) fn limits(checker: &mut Checker, drafts: &[Draft<'_>]) {
    for draft in drafts {
        let Some((_, class)) = &draft.class else { continue };
        let entry = draft.entry;
        if entry.values.bool("retain") == Some(true) && class.retained.is_empty() {
            let message = format!("`retain` has no effect: class `{}` keeps no state", class.name);
            let help = "take it out, or use a class with a record `retained`, `save` and `restore`";
            checker.add(Finding::note(&entry.values.span_of("retain"), message).help(help));
        }
        let open = |path: &str| !entry.inputs.iter().any(|a| a.path == path);
        let names: Vec<_> =
            class.inputs.iter().filter(|p| p.signal && open(&p.path)).map(|p| p.path.as_str()).collect();
        if !names.is_empty() {
            let message =
                format!("signals of block `{}` without a source have quality bad: {}", entry.name, names.join(", "));
            checker.add(Finding::note(&entry.key, message).help("a constant has quality good; a tag has its own"));
        }
    }
}

/// Inputs that see the previous scan, because their source comes later in the same lane.
pub(super) fn order(checker: &mut Checker, model: &Model, drafts: &[Draft<'_>]) {
    for (block, draft) in drafts.iter().enumerate() {
        let b = &model.blocks[block];
        for a in &draft.entry.inputs {
            let Some(port) = b.class.inputs.iter().position(|p| p.path == a.path) else { continue };
            let tag = origin(model, TagRef::Input { block, port });
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
