//! Ports of a version that the plant was not laid out with: they get tags at once, until the plant is laid out for them anew.

use super::prepare::Ready;
use crate::assemble::{Plant, registers};
use crate::lane::{Adapter, Growth};
use crate::model::{Input, TagRef, Variable};
use crate::supervisor::Recipe;
use latchwork_block::Class;
use latchwork_block::upgrade::{Mapping, Transfer};
use std::sync::Arc;

impl Plant {
    /// What a version of a block needs in order to execute in its lane; nothing when the lane was laid out for one like it.
    pub(crate) fn adapter(&self, block: usize, executed: &Class) -> Option<Box<Adapter>> {
        let laid_out = &self.model.blocks[block].class;
        let place = &self.layout.lanes[self.model.blocks[block].lane].blocks[self.desk.places[block] as usize];
        if !place.scattered && Mapping::new(laid_out, executed).is_identity() {
            return None;
        }
        Some(Box::new(Adapter::new(laid_out, &place.ins, &place.outs, executed)))
    }

    /// Whether all ports that come with some versions find a place.
    ///
    /// # Errors
    /// Why not.
    pub(super) fn has_room(&self, ready: &[Ready]) -> Result<(), String> {
        let blocks = ready.iter().map(|part| (part.block, &**part.recipe.template.class()));
        self.layout.room(&self.model, blocks).map_err(|e| e.to_string())
    }

    /// Tags for the ports that come with a version, which there is room for; what its lane has to know of them, if there are any.
    ///
    /// # Errors
    /// A tag has such a name already.
    pub(super) fn grow(&mut self, block: usize, version: &Recipe) -> Result<Option<Box<Growth>>, String> {
        let former = Arc::clone(&self.model.blocks[block].class);
        let class = Arc::new(former.with(version.template.class()));
        let lengths = |c: &Class| [c.inputs.len(), c.outputs.len(), c.settings.len(), c.commands.len(), c.alarms.len()];
        if lengths(&former) == lengths(&class) {
            return Ok(None);
        }
        let model = Arc::make_mut(&mut self.model);
        let b = &mut model.blocks[block];
        b.inputs.resize(class.inputs.len(), Input::Unwired);
        b.settings.resize(class.settings.len(), None);
        b.safe.resize(class.outputs.len(), 0);
        b.class = Arc::clone(&class);
        let layout = Arc::make_mut(&mut self.layout);
        let new = layout.grow(model, block, &former).map_err(|e| e.to_string())?;
        self.desk.refs.extend(new.iter().map(|(what, id)| (*id, *what)));
        for (what, _) in &new {
            if matches!(what, TagRef::Alarm { .. } | TagRef::Command { .. }) {
                let name = model.tag_name(*what);
                model.variables.push(Variable { tag: *what, name, rule: None, text: String::new(), group: None });
            }
        }

        // What the version starts with is to its settings what the plant file is to the others.
        let places = &self.layout.settings[block];
        let mut cells: Vec<_> = places.iter().map(|at| self.desk.cells[*at]).collect();
        Transfer::new(&version.template.class().settings, &class.settings, true).apply(&version.settings, &mut cells);
        for (at, cell) in places.iter().zip(&cells).skip(former.settings.len()) {
            (self.desk.cells[*at], self.desk.of_file[*at]) = (*cell, *cell);
        }
        Ok(Some(self.growth(block)))
    }

    /// A block's ports for its lane, with sources for what makes records.
    fn growth(&mut self, block: usize) -> Box<Growth> {
        let model = Arc::clone(&self.model);
        let (b, lane) = (&model.blocks[block], &self.layout.lanes[model.blocks[block].lane]);
        let place = lane.blocks[self.desk.places[block] as usize].clone();
        let used = lane.used as usize;
        let mut alarm_sources = Vec::new();
        for (bit, alarm) in b.class.alarms.iter().enumerate() {
            let source = self.router.add_source(format!("{}.alarms.{alarm}", b.name));
            alarm_sources.push(source);
            let of_bit = |v: &&Variable| v.tag == TagRef::Alarm { block, bit: bit as u8 };
            if let Some(variable) = model.variables.iter().find(of_bit) {
                if self.annunciator.find(variable).is_none() {
                    self.annunciator.add(&model, variable);
                }
                if let Some(alarm) = self.annunciator.find(variable) {
                    self.annunciator.listen(source, alarm);
                }
            }
        }
        let status = registers(b, &place.status, &mut |name| self.router.add_source(name));
        let executes = Arc::clone(self.supervisor.recipes[block].template.class());
        let adapter = self.adapter(block, &executes);
        let (commands, alarms, qualities, safe) = (place.commands, place.alarms, place.qualities, place.safe);
        Box::new(Growth { used, commands, alarms, alarm_sources, qualities, safe, status, adapter })
    }

    /// What the version of a block that executes now does not have is shown with quality bad.
    pub(super) fn show_ports(&mut self, block: usize) {
        let class = Arc::clone(self.supervisor.recipes[block].template.class());
        Arc::make_mut(&mut self.layout).executes(&self.model, block, &class);
    }
}
