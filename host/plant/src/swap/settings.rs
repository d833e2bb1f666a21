//! Settings of a block whose present version may have others than the plant was laid out with.
//!
//! Tags and what operators write are the laid-out version's; what executes is configured with its own, by name.

use super::Phase;
use crate::assemble::Plant;
use crate::lane::Configured;
use crate::supervisor::Recipe;
use latchwork_block::Class;
use latchwork_block::upgrade::Transfer;
use std::collections::BTreeMap;

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
