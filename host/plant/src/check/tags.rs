//! Every tag of the plant by its name.

use super::drivers::DriverDraft;
use super::lanes::LaneDraft;
use super::{CheckOptions, Draft};
use crate::file::PlantFile;
use crate::model::{Statistic, TagRef};
use latchwork_block::Port;
use latchwork_image::{Type, nearest};
use latchwork_schema::{Checker, Finding, Span};
use std::collections::{HashMap, HashSet};

/// A tag that a wire may name.
pub(super) struct Tag {
    pub(super) tag: TagRef,
    pub(super) ty: Type,
}

/// All tags.
pub(super) struct Tags {
    known: HashMap<String, Tag>,
    /// Owners (`BLOCK`, `DRIVER`, `DRIVER.POINT`) that are there but broken.
    broken: HashSet<String>,
    /// Tables of the file that would hold further owners could not be read.
    incomplete: bool,
    /// Blocks of [sim] that do not count now.
    absent: HashSet<String>,
}

impl Tags {
    pub(super) fn new(
        lanes: &[LaneDraft],
        drivers: &[DriverDraft<'_>],
        blocks: &[Draft<'_>],
        file: &PlantFile,
        options: CheckOptions,
    ) -> Self {
        let mut tags = Self {
            known: HashMap::new(),
            broken: file.refused_lanes.iter().map(|l| format!("lane.{l}")).collect(),
            incomplete: ["driver", "block", "sim", "lane"].iter().any(|t| file.unread.contains(t)),
            absent: HashSet::new(),
        };
        for (lane, draft) in lanes.iter().enumerate() {
            for statistic in Statistic::ALL {
                let name = format!("lane.{}.{}", draft.lane.name, statistic.name());
                tags.known.insert(name, Tag { tag: TagRef::Lane { lane, statistic }, ty: statistic.ty() });
            }
        }
        // Indices count the drivers that the model has.
        for (driver, draft) in drivers.iter().filter(|d| d.driver.is_some()).enumerate() {
            let points = draft.driver.iter().flat_map(|d| &d.config.points);
            for (point, config) in points.enumerate() {
                let name = format!("{}.{}", draft.entry.name, config.name);
                tags.known.insert(name, Tag { tag: TagRef::Point { driver, point }, ty: config.ty.clone() });
            }
        }
        for draft in drivers {
            tags.broken.extend(draft.broken.iter().map(|p| format!("{}.{p}", draft.entry.name)));
            tags.broken.extend(draft.unread.map(str::to_owned));
        }
        for (block, draft) in blocks.iter().enumerate() {
            match &draft.class {
                Some((_, class)) => tags.block(block, &draft.entry.name, class),
                None => drop(tags.broken.insert(draft.entry.name.clone())),
            }
        }
        if !options.sim {
            tags.absent.extend(file.blocks.iter().filter(|b| b.sim).map(|b| b.name.clone()));
        }
        tags
    }

    fn block(&mut self, block: usize, name: &str, class: &latchwork_block::Class) {
        let mut ports = |group: &str, ports: &[Port], tag: fn(usize, usize) -> TagRef| {
            for (port, p) in ports.iter().enumerate() {
                let tag = Tag { tag: tag(block, port), ty: p.ty.clone() };
                self.known.insert(format!("{name}.{group}.{}", p.path), tag);
            }
        };
        ports("inputs", &class.inputs, |block, port| TagRef::Input { block, port });
        ports("outputs", &class.outputs, |block, port| TagRef::Output { block, port });
        ports("settings", &class.settings, |block, port| TagRef::Setting { block, port });
        let mut flags = |group: &str, names: &[String], tag: fn(usize, u8) -> TagRef| {
            for (bit, n) in names.iter().enumerate() {
                self.known.insert(format!("{name}.{group}.{n}"), Tag { tag: tag(block, bit as u8), ty: Type::Bool });
            }
        };
        flags("alarms", &class.alarms, |block, bit| TagRef::Alarm { block, bit });
        flags("commands", &class.commands, |block, bit| TagRef::Command { block, bit });
    }

    /// A tag by its name.
    pub(super) fn get(&self, name: &str) -> Option<&Tag> {
        self.known.get(name)
    }

    /// All tags.
    pub(super) fn all(&self) -> impl Iterator<Item = (&str, TagRef)> {
        self.known.iter().map(|(name, t)| (name.as_str(), t.tag))
    }

    /// All bools with their names: alarms by block and bit, then commands, then the others by name.
    pub(super) fn bools(&self) -> Vec<(&str, TagRef)> {
        let bools = self.known.iter().filter(|(_, t)| t.ty == Type::Bool);
        let mut list: Vec<_> = bools.map(|(name, t)| (name.as_str(), t.tag)).collect();
        list.sort_unstable_by_key(|(name, tag)| (order(*tag), *name));
        list
    }

    /// A tag by its name, or a finding; silent where its owner is broken.
    pub(super) fn find(&self, checker: &mut Checker, name: &str, span: &Span) -> Option<&Tag> {
        if let Some(tag) = self.known.get(name) {
            return Some(tag);
        }
        let owner_is_in = |set: &HashSet<String>| {
            set.iter().any(|o| name == o || name.strip_prefix(o.as_str()).is_some_and(|rest| rest.starts_with('.')))
        };
        if owner_is_in(&self.broken) || (self.incomplete && !self.owner_is_known(name)) {
            return None;
        }
        let finding = Finding::error(span, format!("there is no tag `{name}`"));
        checker.add(if owner_is_in(&self.absent) {
            finding.help("its block stands in [sim], which counts only with --sim")
        } else {
            match nearest(name, self.known.keys().map(String::as_str)) {
                Some(near) => finding.help(format!("did you mean `{near}`?")),
                None => finding.maybe_help(self.owner_help(name)),
            }
        });
        None
    }

    /// True when some tag begins with the first part of the name.
    fn owner_is_known(&self, name: &str) -> bool {
        let first = name.split('.').next().unwrap_or(name);
        self.known.keys().any(|k| k.split('.').next() == Some(first))
    }

    /// What a name's owner has, when the owner is known.
    fn owner_help(&self, name: &str) -> Option<String> {
        let mut prefix = name;
        while let Some((shorter, _)) = prefix.rsplit_once('.') {
            let mut below: Vec<_> = self
                .known
                .keys()
                .filter(|k| k.strip_prefix(shorter).is_some_and(|rest| rest.starts_with('.')))
                .map(String::as_str)
                .collect();
            if !below.is_empty() {
                below.sort_unstable();
                let more = if below.len() > 12 { ", …" } else { "" };
                return Some(format!("there are {}{more}", below[..below.len().min(12)].join(", ")));
            }
            prefix = shorter;
        }
        Some("`latchwork tags PLANT` lists every tag of a plant without errors".into())
    }
}

/// Alarms, then commands, by block and bit; then everything else, which has its names.
fn order(tag: TagRef) -> (u8, usize, u8) {
    match tag {
        TagRef::Alarm { block, bit } => (0, block, bit),
        TagRef::Command { block, bit } => (1, block, bit),
        _ => (2, 0, 0),
    }
}
