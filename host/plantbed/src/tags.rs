//! What a plant has that a test can name.

use latchwork_block::{Class, Port};
use latchwork_image::{Type, nearest};
use latchwork_plant::assemble::Plant;
use latchwork_plant::model::TagRef;
use latchwork_schema::{Checker, Finding, Span};
use latchwork_testbed::case::kit::{Group, listed};
use std::collections::BTreeSet;

/// Tags, input points, commands, alarms. A swap brings more.
#[derive(Clone, Default)]
pub(crate) struct Tags {
    /// Name of the plant.
    pub(crate) plant: String,
    /// All tags, as signals: each has a quality.
    pub(crate) all: Vec<Port>,
    /// Input points that a test can drive.
    points: BTreeSet<String>,
    /// Those that a model feeds.
    fed: BTreeSet<String>,
    settings: BTreeSet<String>,
    commands: Vec<String>,
    alarms: Vec<String>,
    /// Blocks with the classes that they are instances of.
    pub(crate) blocks: Vec<(String, String)>,
}

impl Tags {
    /// Those of a plant that has not been swapped in.
    pub(crate) fn of(plant: &Plant) -> Self {
        let (model, layout) = (&plant.model, &plant.layout);
        let mut tags = Self { plant: model.name.clone(), ..Self::default() };
        for (_, tag) in layout.tags.iter() {
            tags.add(&tag.name, &tag.ty);
            if plant.sim.is_fed(&tag.name) {
                tags.fed.insert(tag.name.clone());
            } else if plant.sim.find(&tag.name).is_some() {
                tags.points.insert(tag.name.clone());
            }
        }
        for (what, id) in &layout.ids {
            let name = || layout.tags.get(*id).name.clone();
            match what {
                TagRef::Setting { .. } => drop(tags.settings.insert(name())),
                TagRef::Command { .. } => tags.commands.push(name()),
                _ => {}
            }
        }
        tags.commands.sort_unstable();
        tags.alarms = model.variables.iter().filter(|v| !v.is_command()).map(|v| v.name.clone()).collect();
        tags.blocks = model.blocks.iter().map(|b| (b.name.clone(), b.class.name.clone())).collect();
        tags
    }

    fn add(&mut self, name: &str, ty: &Type) {
        self.all.push(Port { path: name.into(), ty: ty.clone(), signal: true, doc: None });
    }

    /// What another version of a block brings along; what was there stays.
    pub(crate) fn with(mut self, block: &str, class: &Class) -> Self {
        let groups = [("inputs", &class.inputs), ("outputs", &class.outputs), ("settings", &class.settings)];
        for (group, ports) in groups {
            for port in ports {
                let name = format!("{block}.{group}.{}", port.path);
                if group == "settings" {
                    self.settings.insert(name.clone());
                }
                self.more(&name, &port.ty);
            }
        }
        for name in class.commands.iter().map(|c| format!("{block}.commands.{c}")) {
            if self.more(&name, &Type::Bool) {
                self.commands.push(name);
            }
        }
        for name in class.alarms.iter().map(|a| format!("{block}.alarms.{a}")) {
            if self.more(&name, &Type::Bool) {
                self.alarms.push(name);
            }
        }
        self
    }

    fn more(&mut self, name: &str, ty: &Type) -> bool {
        let new = !self.all.iter().any(|p| p.path == name);
        if new {
            self.add(name, ty);
        }
        new
    }

    /// All tags as a group of ports.
    pub(crate) fn group(&self) -> Group<'_> {
        Group { component: &self.plant, name: "", one: "tag", ports: &self.all }
    }

    /// A finding unless the tag is an input point that can be driven.
    pub(crate) fn driven(&self, checker: &mut Checker, tag: &str, span: &Span) -> bool {
        if self.points.contains(tag) {
            return true;
        }
        let finding = if self.fed.contains(tag) {
            Finding::error(span, format!("`{tag}` is fed by [sim.feed]: an input would have no effect"))
                .help(format!("hold it: `force = {{ \"{tag}\" = … }}`, and `unforce` lets it go"))
        } else {
            let list: Vec<_> = self.points.iter().map(String::as_str).collect();
            let points =
                if list.is_empty() { "this plant has none".into() } else { format!("they are {}", listed(&list)) };
            Finding::error(span, format!("`{tag}` is no input point: only those can be driven"))
                .help(format!("{points}; any other tag is held with `force`, settings are written with `settings`"))
        };
        checker.add(finding);
        false
    }

    /// A finding unless the tag is a setting.
    pub(crate) fn set(&self, checker: &mut Checker, tag: &str, span: &Span) -> bool {
        let setting = self.settings.contains(tag);
        if !setting {
            let finding = Finding::error(span, format!("`{tag}` is no setting of a block"));
            checker.add(finding.help(
                "those are BLOCK.settings.NAME; input points change with `inputs`, any tag is held with `force`",
            ));
        }
        setting
    }

    /// Names of all commands.
    pub(crate) fn command_names(&self) -> &[String] {
        &self.commands
    }

    /// Names of all alarms.
    pub(crate) fn alarm_names(&self) -> &[String] {
        &self.alarms
    }

    /// A finding unless there is a command of this name.
    pub(crate) fn command(&self, checker: &mut Checker, name: &str, span: &Span) -> bool {
        known(checker, "command", &self.commands, name, span)
    }

    /// A finding unless there is an alarm of this name.
    pub(crate) fn alarm(&self, checker: &mut Checker, name: &str, span: &Span) -> bool {
        known(checker, "alarm", &self.alarms, name, span)
    }

    /// The same for a name or a glob of names.
    pub(crate) fn alarms(&self, checker: &mut Checker, name: &str, span: &Span) -> bool {
        // The plant says what a glob means when it is asked.
        name.contains(['*', '?', '[', '{']) || self.alarm(checker, name, span)
    }
}

/// A finding unless the name is one of those.
fn known(checker: &mut Checker, what: &str, names: &[String], name: &str, span: &Span) -> bool {
    if names.iter().any(|n| n == name) {
        return true;
    }
    let (message, help) = unknown(what, names, name);
    checker.add(Finding::error(span, message).help(help));
    false
}

/// What is said of a name that is none, and the way out.
pub(crate) fn unknown(what: &str, names: &[String], name: &str) -> (String, String) {
    let list: Vec<_> = names.iter().map(String::as_str).collect();
    // A short name is the end of the full one more often than a misspelling.
    let end = format!(".{name}");
    let meant =
        names.iter().find(|n| n.ends_with(&end)).map(String::as_str).or_else(|| nearest(name, list.iter().copied()));
    let help = match meant {
        Some(near) => format!("did you mean \"{near}\"?"),
        None if names.is_empty() => format!("this plant has no {what}s"),
        None => format!("{what}s are {}", listed(&list)),
    };
    (format!("there is no {what} `{name}`"), help)
}
