//! Growth: tags for ports that a version of a block brings along while the plant runs.
//!
//! What is there stays where it is, and nothing goes away: what others have found stays valid. New cells are taken from the
//! spare ones of the lane and of the operators, so that no region gets longer.

use super::{BlockLayout, Layout, exponent};
use crate::model::{Model, TagRef};
use latchwork_block::Class;
use latchwork_image::{Location, Quality, Source, TagError, TagId, Type};

/// Spare cells of each lane and of the operators: 1 KiB each, copied only as far as they are in use.
const SPARE: usize = 128;
/// Bits of a word of commands or alarms.
const BITS: usize = u64::BITS as usize;

/// Ports that find no place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is room for {room} more of the {needed} {what} that come with it; start the plant anew with the new version: then \
     it is laid out for it"
)]
pub struct NoRoom {
    /// How many there are.
    pub needed: usize,
    /// How many there is room for.
    pub room: usize,
    /// What.
    pub what: &'static str,
}

/// Cells that some ports need.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Needs {
    lane: usize,
    settings: usize,
}

impl Needs {
    /// What a block needs besides in order to become `grown`.
    fn of(class: &Class, grown: &Class) -> Result<Self, NoRoom> {
        for (names, what) in [(&grown.commands, "commands"), (&grown.alarms, "alarms")] {
            if names.len() > BITS {
                return Err(NoRoom { needed: names.len(), room: BITS, what });
            }
        }
        let words = [(&class.commands, &grown.commands), (&class.alarms, &grown.alarms)];
        let words = words.into_iter().filter(|(before, after)| before.is_empty() && !after.is_empty()).count();
        let outputs = &grown.outputs[class.outputs.len()..];
        let cells: usize = outputs.iter().map(|p| 1 + usize::from(p.signal)).sum();
        Ok(Self { lane: words + cells, settings: grown.settings.len() - class.settings.len() })
    }
}

impl Layout {
    /// Sets cells aside, behind all blocks.
    pub(super) fn spare(&mut self) {
        for lane in &mut self.lanes {
            lane.nothing = lane.cells.len() as u32;
            lane.cells.extend([0, Quality::Bad.cell()]);
            lane.used = lane.cells.len() as u32;
            lane.cells.extend([0; SPARE]);
            lane.published = lane.cells.len() as u32;
        }
        self.operators_used = self.operators.len();
        self.operators.extend([0; SPARE]);
    }

    /// Whether there is room for blocks of one lane to become versions, each with what the block had before.
    ///
    /// # Errors
    /// There is none.
    pub fn room<'a>(&self, model: &Model, blocks: impl Iterator<Item = (usize, &'a Class)>) -> Result<(), NoRoom> {
        let (mut all, mut lane) = (Needs::default(), 0);
        for (block, class) in blocks {
            let laid_out = &model.blocks[block].class;
            let needs = Needs::of(laid_out, &laid_out.with(class))?;
            (all.lane, all.settings) = (all.lane + needs.lane, all.settings + needs.settings);
            lane = model.blocks[block].lane;
        }
        let free = (self.lanes[lane].published - self.lanes[lane].used) as usize;
        let free_settings = self.operators.len() - self.operators_used;
        for (needed, room, what) in
            [(all.lane, free, "cells of outputs and alarms"), (all.settings, free_settings, "settings")]
        {
            if needed > room {
                return Err(NoRoom { needed, room, what });
            }
        }
        Ok(())
    }

    /// Places what a block of the model has got besides its former class; there is [room](Self::room). The tags that are new.
    ///
    /// # Errors
    /// There is such a tag already.
    pub fn grow(&mut self, model: &Model, block: usize, former: &Class) -> Result<Vec<(TagRef, TagId)>, TagError> {
        let b = &model.blocks[block];
        let place = self.lanes[b.lane].blocks.iter().position(|p| p.block == block).unwrap_or(0);
        let (region, nothing) = (b.lane as u32, self.lanes[b.lane].nothing);
        let mut at = self.lanes[b.lane].blocks[place].clone();
        let quality = at.quality;
        let mut tags = Vec::new();

        // The words stand behind the ports.
        let behind = at.ins.len() - usize::from(at.commands.is_some());
        let mut more = Vec::new();
        for port in former.inputs.len()..b.class.inputs.len() {
            more.push(nothing);
            more.extend(b.class.inputs[port].signal.then_some(nothing + 1));
            tags.push((TagRef::Input { block, port }, Source::Constant(0)));
        }
        at.ins.splice(behind..behind, more);
        if at.commands.is_none() && !b.class.commands.is_empty() {
            at.commands = Some(self.take(b.lane));
            at.ins.extend(at.commands);
        }
        for bit in former.commands.len()..b.class.commands.len() {
            let location = Location { region, slot: at.commands.unwrap_or(0), bit: Some(bit as u8), quality: None };
            tags.push((TagRef::Command { block, bit: bit as u8 }, Source::Cell(location)));
        }

        let behind = at.outs.len() - usize::from(at.alarms.is_some());
        let mut more = Vec::new();
        for port in former.outputs.len()..b.class.outputs.len() {
            let location = self.grow_output(model, &mut at, port);
            more.push(location.slot);
            more.extend(location.quality.filter(|q| *q != quality));
            tags.push((TagRef::Output { block, port }, Source::Cell(location)));
        }
        at.outs.splice(behind..behind, more);
        if at.alarms.is_none() && !b.class.alarms.is_empty() {
            at.alarms = Some(self.take(b.lane));
            at.outs.extend(at.alarms);
        }
        for bit in former.alarms.len()..b.class.alarms.len() {
            let location =
                Location { region, slot: at.alarms.unwrap_or(0), bit: Some(bit as u8), quality: Some(quality) };
            tags.push((TagRef::Alarm { block, bit: bit as u8 }, Source::Cell(location)));
        }

        for port in former.settings.len()..b.class.settings.len() {
            let slot = self.operators_used;
            self.operators_used += 1;
            self.settings[block].push(slot);
            let region = self.operators_region();
            let location = Location { region, slot: slot as u32, bit: None, quality: None };
            tags.push((TagRef::Setting { block, port }, Source::Cell(location)));
        }
        let before = (former.argument_cells(), former.output_cells());
        at.scattered |= before != (b.class.argument_cells(), b.class.output_cells());
        self.lanes[b.lane].blocks[place] = at;

        let mut new = Vec::new();
        for (what, source) in tags {
            self.tag(model, what, source)?;
            new.push((what, self.ids[&what]));
        }
        Ok(new)
    }

    fn grow_output(&mut self, model: &Model, at: &mut BlockLayout, port: usize) -> Location {
        let b = &model.blocks[at.block];
        let p = &b.class.outputs[port];
        let slot = self.take(b.lane);
        at.safe.push((slot, b.safe[port]));
        if matches!(p.ty, Type::Flags(_)) && p.path.rsplit('.').next() == Some("status") {
            at.status.push((port, slot));
        }
        let quality = if p.signal {
            let quality = self.take(b.lane);
            at.qualities.push(quality);
            quality
        } else {
            at.reals.extend(exponent(p).map(|mask| (slot, mask)));
            at.quality
        };
        Location { region: b.lane as u32, slot, bit: None, quality: Some(quality) }
    }

    /// A spare cell.
    fn take(&mut self, lane: usize) -> u32 {
        let lane = &mut self.lanes[lane];
        lane.used += 1;
        lane.used - 1
    }

    /// Another version of a block executes: what it does not have is shown with quality bad.
    pub fn executes(&mut self, model: &Model, block: usize, class: &Class) {
        let b = &model.blocks[block];
        let lane = &self.lanes[b.lane];
        let Some(at) = lane.blocks.iter().find(|p| p.block == block) else { return };
        let (good, bad) = (at.quality, lane.nothing + 1);
        let outputs = b.class.outputs.iter().enumerate().filter(|(_, p)| !p.signal).map(|(port, p)| {
            let has = class.outputs.iter().any(|o| o.path == p.path && o.ty == p.ty);
            (TagRef::Output { block, port }, has)
        });
        let alarms = b.class.alarms.iter().enumerate();
        let alarms = alarms.map(|(bit, name)| (TagRef::Alarm { block, bit: bit as u8 }, class.alarms.contains(name)));
        for (what, has) in outputs.chain(alarms) {
            let id = self.ids[&what];
            if let Source::Cell(location) = self.tags.get(id).source {
                let quality = Some(if has { good } else { bad });
                self.tags.set_source(id, Source::Cell(Location { quality, ..location }));
            }
        }
    }
}
