//! What of the plant would lead nowhere with another version of a block.

use crate::model::{Input, Model, TagRef};
use latchwork_block::upgrade::{Change, Difference, Part, PortChange};
use latchwork_block::{Class, Port};
use std::collections::HashSet;

/// What operators have under way with tags of blocks, besides what the plant file names.
#[derive(Default)]
pub(super) struct Uses {
    /// Forced.
    pub(super) forced: HashSet<TagRef>,
    /// Staged settings.
    pub(super) staged: HashSet<TagRef>,
    /// Commands that stand.
    pub(super) standing: HashSet<TagRef>,
}

/// Sentences on ports that are gone or of another type: those that somebody uses, and the others.
pub(super) fn broken(model: &Model, uses: &Uses, block: usize, new: &Class) -> (Vec<String>, Vec<String>) {
    let (mut broken, mut notes) = (Vec::new(), Vec::new());
    let class = &model.blocks[block].class;
    for change in &Difference::new(class, new).ports {
        let what = match &change.change {
            Change::Added { .. } => {
                if change.part == Part::Inputs {
                    let name = format!("{}.inputs.{}", model.blocks[block].name, change.name);
                    notes.push(format!(
                        "`{name}` is new: it reads 0 until a plant file wires it, a signal with quality bad"
                    ));
                }
                continue;
            }
            Change::Gone { .. } => "the new version does not have it".to_owned(),
            // Whether a port carries its own quality breaks no wire.
            Change::Type { .. } if same_type(class, new, change) => continue,
            Change::Type { from, to } => format!("it is {to} in the new version, not {from}"),
        };
        let Some(tag) = tag(class, block, change) else { continue };
        let users = users(model, uses, tag);
        let name = model.tag_name(tag);
        if users.is_empty() && !matches!(change.part, Part::Retained) {
            notes.push(format!("`{name}`: {what}; nothing uses it, and its tag keeps its last value"));
        }
        broken.extend(users.into_iter().map(|user| format!("{user} `{name}`: {what}")));
    }
    (broken, notes)
}

fn ports(class: &Class, part: Part) -> &[Port] {
    match part {
        Part::Inputs => &class.inputs,
        Part::Outputs => &class.outputs,
        Part::Settings => &class.settings,
        Part::Retained => &class.retained,
        Part::Commands | Part::Alarms => &[],
    }
}

fn same_type(old: &Class, new: &Class, change: &PortChange) -> bool {
    let find = |class| ports(class, change.part).iter().find(|p| p.path == change.name).map(|p| p.ty.clone());
    find(old) == find(new)
}

/// The tag of a port that the plant was laid out with.
fn tag(class: &Class, block: usize, change: &PortChange) -> Option<TagRef> {
    let port = || ports(class, change.part).iter().position(|p| p.path == change.name);
    let bit = |names: &[String]| names.iter().position(|n| *n == change.name).map(|b| b as u8);
    Some(match change.part {
        Part::Inputs => TagRef::Input { block, port: port()? },
        Part::Outputs => TagRef::Output { block, port: port()? },
        Part::Settings => TagRef::Setting { block, port: port()? },
        Part::Alarms => TagRef::Alarm { block, bit: bit(&class.alarms)? },
        Part::Commands => TagRef::Command { block, bit: bit(&class.commands)? },
        Part::Retained => return None,
    })
}

/// Who uses a tag, each as the beginning of a sentence.
fn users(model: &Model, uses: &Uses, tag: TagRef) -> Vec<String> {
    let mut users = Vec::new();
    if let TagRef::Input { block, port } = tag
        && model.blocks[block].inputs[port] != Input::Unwired
    {
        users.push("the plant file wires".to_owned());
    }
    for (index, block) in model.blocks.iter().enumerate() {
        for (port, input) in block.inputs.iter().enumerate() {
            if matches!(input, Input::Wire(wire) if wire.tag == tag) {
                users.push(format!("`{}` reads", model.tag_name(TagRef::Input { block: index, port })));
            }
        }
    }
    for (index, driver) in model.drivers.iter().enumerate() {
        for (point, source) in driver.sources.iter().enumerate() {
            if source.is_some_and(|wire| wire.tag == tag) {
                users.push(format!("`{}` shows", model.tag_name(TagRef::Point { driver: index, point })));
            }
        }
    }
    for variable in &model.variables {
        if let (true, Some(rule)) = (variable.tag == tag, variable.rule) {
            users.push(format!("the [[alarm]] in line {} names", model.alarm_rules[rule].line));
        }
    }
    for rule in &model.alarm_rules {
        if rule.suppress.is_some_and(|wire| wire.tag == tag) {
            users.push(format!("the [[alarm]] in line {} is suppressed by", rule.line));
        }
    }
    let tables = model.tables.iter().filter(|t| t.tags.contains(&tag));
    users.extend(tables.map(|t| format!("[table.{}] has", t.name)));
    for (of, what) in [
        (&uses.forced, "an operator forces"),
        (&uses.staged, "a value is staged for"),
        (&uses.standing, "a command stands:"),
    ] {
        if of.contains(&tag) {
            users.push(what.to_owned());
        }
    }
    users
}
