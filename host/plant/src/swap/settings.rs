//! Settings of a block whose present version may have others than the plant was laid out with.
//!
//! Tags and what operators write are the laid-out version's; what executes is configured with its own, by name.

use super::Phase;
use crate::assemble::Plant;
use crate::lane::Configured;
use crate::model::TagRef;
use crate::operate::Operator;
use crate::supervisor::Recipe;
use latchwork_block::Class;
use latchwork_block::upgrade::Transfer;
use latchwork_record::Kind;
use std::collections::BTreeMap;
use std::sync::Arc;

impl Plant {
    /// All settings of what executes, some of them changed: by port of the laid-out version.
    ///
    /// # Errors
    /// What executes does not have one of them.
    pub(crate) fn changed_settings(&self, block: usize, ports: &BTreeMap<usize, u64>) -> Result<Box<[u64]>, String> {
        changed(&self.model.blocks[block].class, &self.supervisor.recipes[block], ports)
    }

    /// The same for the version before, while it waits. What it does not have does not concern it.
    pub(crate) fn changed_waiting(&self, block: usize, ports: &BTreeMap<usize, u64>) -> Option<Box<[u64]>> {
        let on_probation = |s: &super::Swap| matches!(s.phase, Phase::Probation) && s.blocks.contains(&block);
        self.swaps.under_way.iter().find(|s| on_probation(s))?;
        let before = &self.swaps.histories.get(&block)?.earlier.back()?.recipe;
        let class = &self.model.blocks[block].class;
        let known = |port: &usize| place(class, before.template.class(), *port).is_some();
        let ports = ports.iter().filter(|(port, _)| known(port)).map(|(port, cell)| (*port, *cell)).collect();
        changed(class, before, &ports).ok()
    }

    /// Settings were taken by a version that may not execute any more.
    pub(crate) fn settings_taken(&mut self, block: usize, answer: &Configured, now: u64) {
        let history = self.swaps.histories.get_mut(&block);
        let executes = self.supervisor.recipes[block].version == answer.version;
        if let Some(waiting) = &answer.waiting {
            if !executes {
                self.supervisor.recipes[block].settings = waiting.to_vec();
            } else if let Some(before) = history.and_then(|h| h.earlier.back_mut()) {
                before.recipe.settings = waiting.to_vec();
            }
        }
        if executes {
            self.supervisor.recipes[block].settings = answer.cells.to_vec();
        }
        self.show_settings(block, now);
    }

    /// Another version executes, with settings of its own: those that are others now are on record, and kept as if they had
    /// been written.
    pub(super) fn settings_swapped(&mut self, block: usize, operator: &Operator, swap: u64, now: u64) {
        let model = Arc::clone(&self.model);
        let before: Vec<_> = self.layout.settings[block].iter().map(|at| self.desk.cells[*at]).collect();
        self.show_settings(block, now);
        for (port, before) in before.into_iter().enumerate() {
            let cell = self.desk.cells[self.layout.settings[block][port]];
            if cell == before {
                continue;
            }
            let tag = TagRef::Setting { block, port };
            let ty = model.tag_type(tag);
            let mut draft = Self::did(now, Kind::Setting, &model.tag_name(tag), "written", operator);
            (draft.previous, draft.current) = (ty.value(before), ty.value(cell));
            let remark = std::mem::replace(&mut draft.text, format!("with swap {swap}"));
            if !remark.is_empty() {
                draft.text += &format!("; {remark}");
            }
            let kept = self.kept_as(block, port);
            self.tell(draft, vec![kept]);
        }
    }

    /// The plant file says what ran when it was saved: that need not be kept any more.
    pub(super) fn settings_saved(&mut self, swap: &super::Swap, now: u64) {
        let model = Arc::clone(&self.model);
        for (block, keep) in swap.blocks.iter().zip(&swap.keep) {
            let places = self.layout.settings[*block].clone();
            let mut of_file: Vec<_> = places.iter().map(|at| self.desk.of_file[*at]).collect();
            let cells: Vec<_> = keep.settings.iter().map(|(_, cell)| *cell).collect();
            let runs = Arc::clone(self.supervisor.recipes[*block].template.class());
            if runs.settings.len() != cells.len() {
                continue;
            }
            let laid_out = &model.blocks[*block].class.settings;
            Transfer::new(&runs.settings, laid_out, true).apply(&cells, &mut of_file);
            for (port, (at, cell)) in places.iter().zip(of_file).enumerate() {
                let before = std::mem::replace(&mut self.desk.of_file[*at], cell);
                if before == cell {
                    continue;
                }
                let ty = &laid_out[port].ty;
                let tag = model.tag_name(TagRef::Setting { block: *block, port });
                let mut draft = Self::did(now, Kind::Setting, &tag, "saved", &swap.operator);
                (draft.previous, draft.current) = (ty.value(before), ty.value(cell));
                draft.text = format!("with swap {}: the plant file says so now", swap.status.number);
                let kept = self.kept_as(*block, port);
                self.tell(draft, vec![kept]);
            }
        }
    }

    /// Shows the settings in effect. One that what executes does not have keeps its last value.
    pub(crate) fn show_settings(&mut self, block: usize, now: u64) {
        let (laid_out, recipe) = (&self.model.blocks[block].class, &self.supervisor.recipes[block]);
        let transfer = Transfer::new(&recipe.template.class().settings, &laid_out.settings, true);
        let places = &self.layout.settings[block];
        let mut shown: Vec<_> = places.iter().map(|at| self.desk.cells[*at]).collect();
        transfer.apply(&recipe.settings, &mut shown);
        places.iter().zip(shown).for_each(|(at, cell)| self.desk.cells[*at] = cell);
        self.desk.publish(now);
    }

    /// A block's settings cannot be written now: its lane is about to exchange it.
    pub(crate) fn settings_wait(&self, block: usize) -> bool {
        let exchanging = |s: &super::Swap| matches!(s.phase, Phase::Exchanging(_) | Phase::TakingBack(_));
        self.swaps.under_way.iter().any(|s| exchanging(s) && s.blocks.contains(&block))
    }
}

fn changed(laid_out: &Class, recipe: &Recipe, ports: &BTreeMap<usize, u64>) -> Result<Box<[u64]>, String> {
    let class = recipe.template.class();
    let mut cells: Box<[u64]> = recipe.settings.as_slice().into();
    for (port, cell) in ports {
        let name = &laid_out.settings[*port].path;
        let to = place(laid_out, class, *port)
            .ok_or_else(|| format!("the version that runs has no setting `{name}`, or one of another kind"))?;
        let one = Transfer::new(&laid_out.settings[*port..=*port], &class.settings[to..=to], true);
        one.apply(&[*cell], &mut cells[to..=to]);
    }
    Ok(cells)
}

/// Where a laid-out setting stands among those of another version that can take its value.
fn place(laid_out: &Class, class: &Class, port: usize) -> Option<usize> {
    let to = class.settings.iter().position(|p| p.path == laid_out.settings[port].path)?;
    let one = Transfer::new(&laid_out.settings[port..=port], &class.settings[to..=to], true);
    let moved = |f: &latchwork_block::upgrade::Field| !matches!(f.fate, latchwork_block::upgrade::Fate::New);
    one.fields().first().filter(|f| moved(f)).map(|_| to)
}
