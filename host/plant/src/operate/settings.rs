//! Settings: staged, written to the block through its `configure`, read back.

use super::desk::{Configuring, Ticket};
use super::tags::shown;
use super::{Operator, Pending, Refused, TagRow};
use crate::assemble::Plant;
use crate::lane::{Configured, Request};
use crate::model::TagRef;
use latchwork_image::nearest;
use latchwork_record::{Kept, Kind};
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// Beginning of the names that written settings are kept under.
pub(super) const PREFIX: &str = "setting/";
/// After so long, ns of plant time, whoever waits is told that the lane has not executed yet.
const PATIENCE: u64 = 2_000_000_000;

/// Settings to write: by block and port.
pub(super) type Writes = BTreeMap<usize, BTreeMap<usize, u64>>;

/// What was staged, and what was set at once.
pub(super) struct Staged {
    pub(super) done: Vec<String>,
    pub(super) settings: Writes,
}

impl Plant {
    /// Stages settings; points of `sim` drivers are set at once. All of it or nothing.
    pub(super) fn stage(
        &mut self,
        values: &[(String, String)],
        write: bool,
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
        let (mut done, mut writes) = (Vec::new(), Writes::new());
        for (name, ty, block, port, cell) in settings {
            let effective = self.desk.cells[self.layout.settings[block][port]];
            self.desk.staged.entry(block).or_default().insert(port, cell);
            let mut draft = Self::did(now, Kind::Setting, name, "staged", operator);
            (draft.previous, draft.current) = (ty.value(effective), ty.value(cell));
            self.tell(draft, Vec::new());
            if !write {
                done.push(format!("{name}: {} is staged, {} is in effect", ty.format(cell), ty.format(effective)));
            }
            writes.entry(block).or_default().insert(port, cell);
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
        Ok(Staged { done, settings: writes })
    }

    pub(crate) fn block(&self, name: &str) -> Result<usize, Refused> {
        self.model.blocks.iter().position(|b| b.name == name).ok_or_else(|| {
            let near = nearest(name, self.model.blocks.iter().map(|b| b.name.as_str()));
            let hint = near.map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
            Refused::new("unknown", format!("there is no block `{name}`{hint}"))
        })
    }

    /// All that is staged for a block.
    pub(super) fn staged(&self, name: &str) -> Result<Writes, Refused> {
        let block = self.block(name)?;
        if let Some(staged) = self.desk.staged.get(&block).filter(|s| !s.is_empty()) {
            return Ok([(block, staged.clone())].into());
        }
        Err(Refused::new("state", format!("nothing is staged for `{name}`; stage settings with `set`")))
    }

    /// Sends settings on their way to their blocks; the answer comes when each of them has taken or refused its own.
    pub(super) fn write_settings(&mut self, writes: Writes, done: Vec<String>, pending: Pending, now: u64) {
        let busy = |name: &str, why: &str| Refused::new("busy", format!("`{name}`: {why}"));
        let blocks = &self.model.blocks;
        for block in writes.keys() {
            if self.desk.configuring.iter().any(|c| c.block == *block) {
                let why = busy(&blocks[*block].name, "settings are on their way to it already; try again");
                return self.refuse(pending, why, now);
            }
            if let Err(why) = self.lane_runs(blocks[*block].lane) {
                return self.refuse(pending, why, now);
            }
            if self.settings_wait(*block) {
                let why = busy(&blocks[*block].name, "its lane is about to exchange it; try again");
                return self.refuse(pending, why, now);
            }
        }
        let operator = pending.operator.clone();
        let ticket = Ticket { pending: Some(pending), left: writes.len(), done, refused: None };
        let ticket = Arc::new(Mutex::new(ticket));
        for (block, ports) in writes {
            self.desk.number += 1;
            let number = self.desk.number;
            let (cells, waiting) = (self.changed_settings(block, &ports), self.changed_waiting(block, &ports));
            let configuring = Configuring {
                number,
                block,
                ports,
                operator: operator.clone(),
                ticket: Arc::clone(&ticket),
                asked: now,
            };
            let cells = match cells {
                Ok(cells) => cells,
                Err(why) => {
                    self.not_taken(configuring, "state", &why, now);
                    continue;
                }
            };
            let (place, version) = (self.desk.places[block], self.supervisor.recipes[block].version);
            let request = Request::Configure { block: place, number, version, cells, waiting };
            if self.supervisor.send(self.model.blocks[block].lane, request).is_ok() {
                self.desk.configuring.push(configuring);
            } else {
                let why = "its lane has not taken earlier requests; does it run?";
                self.not_taken(configuring, "busy", why, now);
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
                    match &answer.result {
                        Ok(()) => self.taken(configuring, &answer, now),
                        Err(why) => self.not_taken(configuring, "value", why.as_str(), now),
                    }
                }
            }
        }
        for configuring in &self.desk.configuring {
            if now.saturating_sub(configuring.asked) > PATIENCE {
                let name = &self.model.blocks[configuring.block].name;
                let sentence = format!("{name}: its lane has not executed yet; it takes the settings when it does");
                configuring.ticket().give_up_waiting(sentence);
            }
        }
    }

    /// A block that does not take settings: they are not staged any more, or the next ones would fail with them.
    fn not_taken(&mut self, configuring: Configuring, reason: &'static str, why: &str, now: u64) {
        let name = self.model.blocks[configuring.block].name.clone();
        if let Some(staged) = self.desk.staged.get_mut(&configuring.block) {
            staged.retain(|port, cell| configuring.ports.get(port) != Some(cell));
        }
        let mut draft = Self::did(now, Kind::Setting, &name, "refused", &configuring.operator);
        draft.text = format!("write-values: {why}; {}", draft.text);
        self.tell(draft, Vec::new());
        configuring.ticket().refused(Refused::new(reason, format!("`{name}` refuses the settings: {why}")));
    }

    fn taken(&mut self, configuring: Configuring, answer: &Configured, now: u64) {
        let block = configuring.block;
        let model = Arc::clone(&self.model);
        let mut sentences = Vec::new();
        for (port, cell) in &configuring.ports {
            let ty = &model.blocks[block].class.settings[*port].ty;
            let tag = model.tag_name(TagRef::Setting { block, port: *port });
            let at = self.layout.settings[block][*port];
            let (before, of_file) = (self.desk.cells[at], self.desk.of_file[at]);
            let kept = json!({ "value": ty.format(*cell), "file": ty.format(of_file) });
            let value = (*cell != of_file).then(|| kept.to_string());
            let mut draft = Self::did(now, Kind::Setting, &tag, "written", &configuring.operator);
            (draft.previous, draft.current) = (ty.value(before), ty.value(*cell));
            self.tell(draft, vec![Kept { name: format!("{PREFIX}{tag}"), value }]);
            sentences.push(format!("{tag} is {} now, it was {}", ty.format(*cell), ty.format(before)));
        }
        // What was staged in the meantime stays.
        if let Some(staged) = self.desk.staged.get_mut(&block) {
            staged.retain(|port, cell| configuring.ports.get(port) != Some(cell));
        }
        self.settings_taken(block, answer, now);
        configuring.ticket().taken(sentences);
    }

    /// New settings are in effect: shown, and what a restarted block gets.
    pub(super) fn take_settings(&mut self, block: usize, cells: &[u64], now: u64) {
        self.supervisor.recipes[block].settings = cells.to_vec();
        self.show_settings(block, now);
    }

    /// Settings are on their way to a block.
    pub(crate) fn settings_under_way(&self, block: usize) -> bool {
        self.desk.configuring.iter().any(|c| c.block == block)
    }

    pub(super) fn discard(&mut self, name: &str, operator: &Operator, now: u64) -> Result<Vec<String>, Refused> {
        let staged = self.staged(name)?;
        let count: usize = staged.values().map(BTreeMap::len).sum();
        if self.desk.configuring.iter().any(|c| staged.contains_key(&c.block)) {
            return Err(Refused::new("busy", format!("`{name}`: settings are on their way to it; try again")));
        }
        staged.keys().for_each(|block| drop(self.desk.staged.remove(block)));
        let draft = Self::did(now, Kind::Setting, name, "discarded", operator);
        self.tell(draft, Vec::new());
        Ok(vec![format!("{name}: {count} staged settings are forgotten")])
    }

    /// Settings of a block: in effect; after each one that is staged, with the tag's name and ` (staged)`, that value.
    pub(super) fn read_values(&self, name: &str) -> Result<Vec<TagRow>, Refused> {
        let block = self.block(name)?;
        let (places, mut rows) = (&self.layout.settings[block], Vec::new());
        for (port, p) in self.model.blocks[block].class.settings.iter().enumerate() {
            let row = |tag: String, cell| TagRow {
                tag,
                ty: p.ty.to_string(),
                value: shown(&p.ty, cell),
                quality: "good",
                forced: false,
            };
            let tag = self.model.tag_name(TagRef::Setting { block, port });
            rows.push(row(tag.clone(), self.desk.cells[places[port]]));
            if let Some(cell) = self.desk.staged.get(&block).and_then(|s| s.get(&port)) {
                rows.push(row(format!("{tag} (staged)"), *cell));
            }
        }
        Ok(rows)
    }
}
