//! Settings: staged, written to the block through its `configure`, read back.

use super::desk::Configuring;
use super::serve::done;
use super::tags::shown;
use super::{Operator, Pending, Refused, TagRow};
use crate::assemble::Plant;
use crate::lane::{Configured, Request};
use crate::model::TagRef;
use latchwork_image::nearest;
use latchwork_record::{Kept, Kind};
use serde_json::json;

/// Beginning of the names that written settings are kept under.
pub(super) const PREFIX: &str = "setting/";
/// After so long, ns of plant time, whoever waits is told that the lane has not executed yet.
const PATIENCE: u64 = 2_000_000_000;

/// What was staged.
pub(super) struct Staged {
    pub(super) done: Vec<String>,
    /// Blocks with staged settings among what was set.
    pub(super) blocks: Vec<usize>,
}

impl Plant {
    /// Stages settings; points of `sim` drivers are set at once. All of it or nothing.
    pub(super) fn stage(
        &mut self,
        values: &[(String, String)],
        operator: &Operator,
        now: u64,
    ) -> Result<Staged, Refused> {
        let (mut settings, mut points) = (Vec::new(), Vec::new());
        for (name, value) in values {
            let (id, what) = self.tag(name)?;
            let ty = self.layout.tags.get(id).ty.clone();
            let cell = || ty.parse(value).map_err(|e| Refused::new("value", format!("`{name}`: {e}")));
            match what {
                TagRef::Setting { block, port } => settings.push((name, ty.clone(), block, port, cell()?)),
                TagRef::Point { .. } if self.sim.is_fed(name) => {
                    let message = format!("`{name}` is fed by [sim.feed]; force it instead");
                    return Err(Refused::new("state", message));
                }
                TagRef::Point { .. } if self.sim.find(name).is_some() => points.push((name, id, ty.clone(), cell()?)),
                _ => {
                    let message = format!(
                        "`{name}` cannot be set; settings of blocks can, and input points of `sim` drivers. A command \
                         is given with `command`, any other tag is held with `force`"
                    );
                    return Err(Refused::new("state", message));
                }
            }
        }
        let (mut done, mut blocks) = (Vec::new(), Vec::new());
        for (name, ty, block, port, cell) in settings {
            let effective = self.desk.cells[self.layout.settings[block].start + port];
            self.desk.staged.entry(block).or_default().insert(port, cell);
            let mut draft = Self::did(now, Kind::Setting, name, "staged", operator);
            (draft.previous, draft.current) = (ty.value(effective), ty.value(cell));
            self.tell(draft, Vec::new());
            done.push(format!("{name}: {} is staged, {} is in effect", ty.format(cell), ty.format(effective)));
            if !blocks.contains(&block) {
                blocks.push(block);
            }
        }
        for (name, id, ty, cell) in points {
            let Some((place, _)) = self.sim.find(name) else { continue };
            let before = self.cell(id);
            self.sim.set(place, cell, now);
            let mut draft = Self::did(now, Kind::Audit, name, "set", operator);
            (draft.previous, draft.current) = (ty.value(before), ty.value(cell));
            self.tell(draft, Vec::new());
            done.push(format!("{name} is {} now", ty.format(cell)));
        }
        Ok(Staged { done, blocks })
    }

    fn block(&self, name: &str) -> Result<usize, Refused> {
        self.model.blocks.iter().position(|b| b.name == name).ok_or_else(|| {
            let near = nearest(name, self.model.blocks.iter().map(|b| b.name.as_str()));
            let hint = near.map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
            Refused::new("unknown", format!("there is no block `{name}`{hint}"))
        })
    }

    /// A block with staged settings.
    pub(super) fn staged_block(&self, name: &str) -> Result<usize, Refused> {
        let block = self.block(name)?;
        if self.desk.staged.get(&block).is_some_and(|s| !s.is_empty()) {
            return Ok(block);
        }
        Err(Refused::new("state", format!("nothing is staged for `{name}`; stage settings with `set`")))
    }

    /// Sends the staged settings of blocks on their way; the answer comes when the blocks have taken them.
    pub(super) fn write_blocks(&mut self, blocks: &[usize], pending: Pending, now: u64) {
        let mut pending = Some(pending);
        for (at, block) in blocks.iter().enumerate() {
            let Some(operator) = pending.as_ref().map(|p| p.operator.clone()) else { return };
            let staged = self.desk.staged.get(block).cloned().unwrap_or_default();
            let range = self.layout.settings[*block].clone();
            let mut cells: Box<[u64]> = self.desk.cells[range].into();
            staged.iter().for_each(|(port, cell)| cells[*port] = *cell);
            self.desk.number += 1;
            let number = self.desk.number;
            let request = Request::Configure { block: self.desk.places[*block], number, cells };
            if self.supervisor.send(self.model.blocks[*block].lane, request).is_err() {
                let message = "the lane has not taken earlier requests; does it run?";
                if let Some(pending) = pending.take() {
                    pending.answer(Err(Refused::new("busy", message)));
                }
                return;
            }
            // The last block's answer is everybody's: a lane takes requests in their order.
            let last = at + 1 == blocks.len();
            let waits = if last { pending.take() } else { None };
            let ports = staged.into_keys().collect();
            self.desk.configuring.push(Configuring {
                number,
                block: *block,
                ports,
                operator,
                pending: waits,
                asked: now,
            });
            if last {
                return;
            }
        }
    }

    /// What the lanes said to settings.
    pub(super) fn configured(&mut self, now: u64) {
        for lane in 0..self.supervisor.lanes.len() {
            while let Ok(answer) = self.supervisor.lanes[lane].configured.pop() {
                let at = self.desk.configuring.iter().position(|c| c.number == answer.number);
                if let Some(at) = at {
                    let configuring = self.desk.configuring.remove(at);
                    self.taken(configuring, &answer, now);
                }
            }
        }
        for configuring in &mut self.desk.configuring {
            if now.saturating_sub(configuring.asked) > PATIENCE
                && let Some(pending) = configuring.pending.take()
            {
                let name = &self.model.blocks[configuring.block].name;
                let sentence = format!("{name}: its lane has not executed yet; it takes the settings when it does");
                pending.answer(Ok(done(vec![sentence])));
            }
        }
    }

    fn taken(&mut self, configuring: Configuring, answer: &Configured, now: u64) {
        let Configuring { block, ports, operator, pending, .. } = configuring;
        let model = std::sync::Arc::clone(&self.model);
        let name = &model.blocks[block].name;
        if let Err(why) = &answer.result {
            let sentence = format!("`{name}` refuses the settings: {}", why.as_str());
            let mut draft = Self::did(now, Kind::Setting, name, "refused", &operator);
            draft.text = format!("write-values: {}; {}", why.as_str(), draft.text);
            self.tell(draft, Vec::new());
            if let Some(pending) = pending {
                pending.answer(Err(Refused::new("value", sentence)));
            }
            return;
        }
        let start = self.layout.settings[block].start;
        let mut sentences = Vec::new();
        for port in ports {
            let (tag, ty) = (TagRef::Setting { block, port }, &model.blocks[block].class.settings[port].ty);
            let tag = model.tag_name(tag);
            let (before, cell) = (self.desk.cells[start + port], answer.cells[port]);
            let of_file = self.desk.of_file[start + port];
            let kept = json!({ "value": ty.format(cell), "file": ty.format(of_file) });
            let value = (cell != of_file).then(|| kept.to_string());
            let mut draft = Self::did(now, Kind::Setting, &tag, "written", &operator);
            (draft.previous, draft.current) = (ty.value(before), ty.value(cell));
            self.tell(draft, vec![Kept { name: format!("{PREFIX}{tag}"), value }]);
            sentences.push(format!("{tag} is {} now, it was {}", ty.format(cell), ty.format(before)));
            // What was staged in the meantime stays.
            let staged = self.desk.staged.entry(block).or_default();
            if staged.get(&port) == Some(&cell) {
                staged.remove(&port);
            }
        }
        self.take_settings(block, &answer.cells, now);
        if let Some(pending) = pending {
            pending.answer(Ok(done(sentences)));
        }
    }

    /// New settings are in effect: shown, and what a restarted block gets.
    pub(super) fn take_settings(&mut self, block: usize, cells: &[u64], now: u64) {
        let range = self.layout.settings[block].clone();
        self.desk.cells[range].copy_from_slice(cells);
        self.supervisor.recipes[block].settings = cells.to_vec();
        if let Some(region) = &mut self.desk.region {
            region.publish(&self.desk.cells, now);
        }
    }

    pub(super) fn discard(&mut self, name: &str, operator: &Operator, now: u64) -> Result<Vec<String>, Refused> {
        let block = self.staged_block(name)?;
        let staged = self.desk.staged.remove(&block).unwrap_or_default();
        let draft = Self::did(now, Kind::Setting, name, "discarded", operator);
        self.tell(draft, Vec::new());
        Ok(vec![format!("{name}: {} staged settings are forgotten", staged.len())])
    }

    /// Settings of a block: in effect; after each one that is staged, with the tag's name and ` (staged)`, that value.
    pub(super) fn read_values(&self, name: &str) -> Result<Vec<TagRow>, Refused> {
        let block = self.block(name)?;
        let (start, mut rows) = (self.layout.settings[block].start, Vec::new());
        for (port, p) in self.model.blocks[block].class.settings.iter().enumerate() {
            let row = |tag: String, cell| TagRow {
                tag,
                ty: p.ty.to_string(),
                value: shown(&p.ty, cell),
                quality: "good",
                forced: false,
            };
            let tag = self.model.tag_name(TagRef::Setting { block, port });
            rows.push(row(tag.clone(), self.desk.cells[start + port]));
            if let Some(cell) = self.desk.staged.get(&block).and_then(|s| s.get(&port)) {
                rows.push(row(format!("{tag} (staged)"), *cell));
            }
        }
        Ok(rows)
    }
}
