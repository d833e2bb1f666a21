//! Blocks: inputs, settings, safe values and limits.

use super::Draft;
use super::lanes::LaneDraft;
use super::tags::Tags;
use super::values::{cell, has_words, near_word};
use super::wires::{End, wire};
use crate::file::{Assignment, PlantFile, Source};
use crate::model::{Block, Input, OnFault};
use latchwork_block::Port;
use latchwork_image::{format_duration, nearest};
use latchwork_schema::{Checker, Constant, Finding};

const MS: u64 = 1_000_000;

/// Blocks of the model, `None` where the draft is broken.
pub(super) fn blocks(
    checker: &mut Checker,
    drafts: &[Draft<'_>],
    lanes: &[LaneDraft],
    tags: &Tags,
    file: &PlantFile,
) -> Vec<Option<Block>> {
    drafts.iter().map(|draft| block(checker, draft, lanes, tags, file)).collect()
}

fn block(
    checker: &mut Checker,
    draft: &Draft<'_>,
    lanes: &[LaneDraft],
    tags: &Tags,
    file: &PlantFile,
) -> Option<Block> {
    let entry = draft.entry;
    let values = &entry.values;
    let lane = values.text("lane").and_then(|name| {
        let found = lanes.iter().position(|l| l.lane.name == name);
        // One that was refused, or that there is no lane at all, is an error of its own.
        let told = lanes.is_empty() || file.refused_lanes.iter().any(|l| l == name);
        if found.is_none() && !told {
            let finding = Finding::error(&values.span_of("lane"), format!("there is no lane `{name}`"));
            let names = || lanes.iter().map(|l| l.lane.name.as_str());
            checker.add(match nearest(name, names()) {
                Some(near) => finding.help(format!("did you mean `{near}`?")),
                None => finding.help(format!("there are {}", names().collect::<Vec<_>>().join(", "))),
            });
        }
        found
    });
    if values.text("wasi") == Some("empty") {
        let finding = Finding::error(&values.span_of("wasi"), "`wasi = \"empty\"` is not supported by this version");
        checker.add(finding.help("build the component without WASI imports"));
    }
    // Without its class nothing can be said about its ports.
    let (component, class) = draft.class.clone()?;
    let inputs = inputs(checker, &entry.name, &entry.inputs, &class.inputs, tags);
    let settings = cells(checker, &entry.name, "settings", &entry.settings, &class.settings);
    let safe = cells(checker, &entry.name, "safe", &entry.safe, &class.outputs);
    let lane = lane?;
    let every = lanes[lane].lane.every;
    let budget = values.duration("budget").unwrap_or((every / 2).clamp(MS, 100 * MS));
    if values.has("budget") && budget > every && lanes[lane].lane.interrupt.is_none() {
        let (budget, every) = (format_duration(budget), format_duration(every));
        let message = format!("`budget` is {budget}, longer than the lane's period of {every}");
        checker.add(Finding::note(&values.span_of("budget"), message).help("a block that uses it up makes overruns"));
    }
    Some(Block {
        name: entry.name.clone(),
        named: values.text("component").unwrap_or_default().to_owned(),
        component,
        class,
        lane,
        inputs,
        settings,
        safe: safe.into_iter().map(|c| c.unwrap_or(0)).collect(),
        on_fault: match values.text("on-fault") {
            Some("hold") => OnFault::Hold,
            Some("stop-lane") => OnFault::StopLane,
            _ => OnFault::Safe,
        },
        budget,
        memory: values.size("memory").unwrap_or(4 << 20),
        retain: values.bool("retain").unwrap_or(false),
        sim: entry.sim,
    })
}

/// The port an assignment names, or a finding.
fn port(checker: &mut Checker, block: &str, group: &str, of: &Assignment, ports: &[Port]) -> Option<usize> {
    let found = ports.iter().position(|p| p.path == of.path);
    if found.is_none() {
        let what = match group {
            "inputs" => "input",
            "settings" => "setting",
            _ => "output",
        };
        let names = || ports.iter().map(|p| p.path.as_str());
        let below = |path: &str| names().filter(|n| n.starts_with(&format!("{path}."))).collect::<Vec<_>>();
        let fields = below(&of.path);
        if !fields.is_empty() {
            let message = format!("{what} `{}` of block `{block}` is a record; its fields have the values", of.path);
            checker.add(Finding::error(&of.key, message).help(format!("they are {}", fields.join(", "))));
            return None;
        }
        let wired = of.path.strip_suffix(".tag").or_else(|| of.path.strip_suffix(".not"));
        if let Some(path) = wired.filter(|path| group != "inputs" && names().any(|n| n == *path)) {
            let message = format!("{what} `{path}` of block `{block}` takes a constant; only inputs read tags");
            checker.add(Finding::error(&of.key, message).help(format!("write `{group}.{path} = …` with the value")));
            return None;
        }
        let finding = Finding::error(&of.key, format!("block `{block}` has no {what} `{}`", of.path));
        checker.add(match nearest(&of.path, names()) {
            Some(near) => finding.help(format!("did you mean `{near}`?")),
            None if ports.is_empty() => finding.help(format!("its class has no {group}")),
            None => finding.help(format!("it has {}", names().collect::<Vec<_>>().join(", "))),
        });
    }
    found
}

fn inputs(checker: &mut Checker, block: &str, given: &[Assignment], ports: &[Port], tags: &Tags) -> Vec<Input> {
    let mut inputs = vec![Input::Unwired; ports.len()];
    for a in given {
        let Some(index) = port(checker, block, "inputs", a, ports) else { continue };
        let name = format!("{block}.inputs.{}", a.path);
        let ty = &ports[index].ty;
        let end = End { name: &name, ty };
        let input = match &a.source {
            Source::Tag { tag, not } => wire(checker, tags, tag, *not, &end, &a.span).map(Input::Wire),
            // A string may be a tag, or a duration, an enum's case, flags.
            Source::Constant(Constant::Text(text)) => {
                let as_constant = if tags.get(text).is_none() { ty.parse(text).ok() } else { None };
                match as_constant {
                    Some(cell) if has_words(ty) => Some(Input::Constant(cell)),
                    Some(_) => {
                        let message = format!("`{name}` is the string \"{text}\"; it takes {}", ty.refuse("").expected);
                        checker.add(Finding::error(&a.span, message).help(format!("write {text} without quotes")));
                        None
                    }
                    None if has_words(ty) && !text.contains('.') => {
                        let message = format!("`{name}` is \"{text}\"; it takes {}", ty.refuse("").expected);
                        let near = near_word(ty, text).map(|n| format!("did you mean \"{n}\"?"));
                        let help = near.unwrap_or_else(|| "or the name of a tag".into());
                        checker.add(Finding::error(&a.span, message).help(help));
                        None
                    }
                    _ => wire(checker, tags, text, false, &end, &a.span).map(Input::Wire),
                }
            }
            Source::Constant(c) => cell(checker, ty, c, &name, &a.span).map(Input::Constant),
        };
        if let Some(input) = input {
            inputs[index] = input;
        }
    }
    inputs
}

/// Constants for ports: settings, or safe values of outputs.
fn cells(checker: &mut Checker, block: &str, group: &str, given: &[Assignment], ports: &[Port]) -> Vec<Option<u64>> {
    let mut cells = vec![None; ports.len()];
    for a in given {
        let Some(index) = port(checker, block, group, a, ports) else { continue };
        if let Source::Constant(c) = &a.source {
            cells[index] = cell(checker, &ports[index].ty, c, &format!("{block}.{group}.{}", a.path), &a.span);
        }
    }
    cells
}
