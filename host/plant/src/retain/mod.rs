//! State that outlives a restart: `retain = true`.
//!
//! By the clock, and lane by lane, one block after the other is asked for its state; the lane does that when it has time.
//! What has changed goes to a [`Vault`], which writes it on a thread of its own.
//!
//! ```text
//! round (every) ─► Request::Save ─► lane, between two scans ─► Report::Saved ─► states ─► Vault
//! after a swap ──┘                                                                │
//! stop, before a swap ────────────────────────────────────────────────────────────┘
//! ```
//!
//! What a swap wants saved goes before what a round has still before it, and is written as soon as it is there.

mod end;
mod pass;
mod restore;
mod status;

use crate::assemble::Plant;
use crate::lane::{LaneState, Recent, Request, Save, SaveAnswer, SaveResult};
use crate::layout::STATE;
use crate::supervisor::Recipe;
use latchwork_block::{Class, Component, upgrade};
use latchwork_record::{Draft, Kind};
use latchwork_retain::{Found, Retained, Saved as State, Trouble, Vault, Version};
use pass::Pass;
use std::sync::Arc;

/// Time between two rounds, ns.
pub(crate) const EVERY: u64 = 60_000_000_000;
/// Source of records about the keeping itself.
const SOURCE: &str = "retain";
/// Priority of a record that nothing can be kept.
const REFUSED: u8 = 200;

/// What was saved, and when it is saved next; idle without a vault.
#[derive(Default)]
pub(crate) struct Keeper {
    keeping: Option<Keeping>,
}

struct Keeping {
    vault: Box<dyn Vault>,
    every: u64,
    /// The states as they were saved last.
    states: Retained,
    /// They are others than those that the vault got.
    changed: bool,
    /// Blocks with `retain = true`.
    members: Vec<Member>,
    /// Per lane.
    passes: Vec<Pass>,
    /// Plant time of the next round, ns.
    next: u64,
    /// A round is under way.
    round: bool,
}

/// A block with `retain = true`.
struct Member {
    /// Index in the model.
    block: usize,
    name: String,
    /// Index in its lane.
    place: u32,
    version: Arc<Version>,
    /// Fields of the state.
    fields: usize,
    /// Number of the version, so that an answer of an older one is known as such.
    number: u64,
    /// The cells that go to the lane and come back; `None` while they are there.
    cells: Option<Box<[u64]>>,
    /// What its last saves took, ns.
    took: Recent,
    /// Plant time of the last save, ns.
    saved: Option<u64>,
}

impl Member {
    fn new(block: usize, name: &str, place: u32, component: &Component, recipe: &Recipe) -> Self {
        let class = recipe.template.class();
        Self {
            block,
            name: name.into(),
            place,
            version: Arc::new(version(component, class)),
            fields: class.retained.len(),
            number: recipe.version,
            cells: None,
            took: Recent::default(),
            saved: None,
        }
    }
}

fn version(component: &Component, class: &Class) -> Version {
    Version {
        class: class.name.clone(),
        component: component.name().into(),
        hash: component.hash().into(),
        schema: upgrade::schema(&class.retained),
    }
}

impl Plant {
    /// Takes over the states that an earlier run has left, and keeps those of this run in a vault; call it before the run,
    /// after [`restore`](Self::restore). What cannot be taken over is told by a record, and its block begins anew.
    pub fn retain(&mut self, found: &Found, vault: Box<dyn Vault>) {
        let model = Arc::clone(&self.model);
        let member = |(index, block): (usize, &crate::model::Block)| {
            block.retain.then(|| {
                let place = self.desk.places[index];
                Member::new(index, &block.name, place, &block.component, &self.supervisor.recipes[index])
            })
        };
        let members: Vec<_> = model.blocks.iter().enumerate().filter_map(member).collect();
        let of_lane = |lane| {
            let of = |(number, member): (usize, &Member)| (model.blocks[member.block].lane == lane).then_some(number);
            Pass::new(members.iter().enumerate().filter_map(of).collect())
        };
        let passes: Vec<_> = (0..model.lanes.len()).map(of_lane).collect();
        let states = self.take_over(found, &members);
        let changed = states.blocks.len() != found.retained.blocks.len();
        let every = model.retain_every;
        let keeping = Keeping { vault, every, states, changed, members, passes, next: every, round: false };
        self.keeper.keeping = Some(keeping);
    }

    /// Saves what is due and stores what was saved, at plant time `now`, ns.
    pub(crate) fn retain_turn(&mut self, now: u64) {
        let Some(keeping) = &mut self.keeper.keeping else { return };
        let mut drafts = Vec::new();
        while let Some(trouble) = keeping.vault.trouble() {
            let mut draft = Draft::new(now, Kind::Io, SOURCE, "accepted");
            draft.priority = REFUSED;
            draft.text = "the retained state is written again".into();
            if let Trouble::Refused(why) = trouble {
                draft.transition = "refused".into();
                draft.text = format!("the retained state cannot be written: {why}; what was written last would count");
            }
            drafts.push(draft);
        }
        if now >= keeping.next {
            // A lane that is slow does not keep the others from being kept.
            keeping.close_round();
            keeping.next = (now / keeping.every.max(1)).saturating_add(1).saturating_mul(keeping.every);
            keeping.round = true;
            keeping.passes.iter_mut().for_each(Pass::begin);
        }
        for (lane, pass) in keeping.passes.iter_mut().enumerate().filter(|(_, p)| p.next().is_some()) {
            let state = LaneState::from_cell(self.regions[lane].cell(STATE));
            if matches!(state, LaneState::Stopped | LaneState::Faulted) {
                pass.end();
            }
            while let Some(number) = pass.next().filter(|_| !pass.asked()) {
                let member = &mut keeping.members[number];
                if member.fields == 0 {
                    pass.skip();
                    continue;
                }
                let cells = member.cells.take().unwrap_or_else(|| vec![0; member.fields].into());
                let request = Request::Save(Save { block: member.place, version: member.number, cells });
                if let Err(Request::Save(save)) = self.supervisor.send(lane, request) {
                    member.cells = Some(save.cells);
                    break;
                }
                pass.ask();
            }
        }
        if keeping.round && keeping.passes.iter().all(Pass::over) {
            keeping.close_round();
        }
        for draft in drafts {
            self.tell(draft, Vec::new());
        }
    }

    /// What a lane answers.
    pub(crate) fn retain_answer(&mut self, lane: usize, saved: SaveAnswer) {
        let epoch = self.router.epoch();
        let Some(keeping) = &mut self.keeper.keeping else { return };
        let pass = &mut keeping.passes[lane];
        let Some(number) = pass.who_is_asked().filter(|n| keeping.members[*n].place == saved.save.block) else {
            return;
        };
        let at_once = pass.answered(saved.result == SaveResult::Busy);
        let member = &mut keeping.members[number];
        if saved.save.version != member.number {
            return;
        }
        if saved.result == SaveResult::Saved {
            member.took.add(saved.took);
            keeping.set(number, &saved.save.cells, saved.time, epoch);
            if at_once {
                keeping.keep(false);
            }
        }
        keeping.members[number].cells = Some(saved.save.cells);
    }

    /// A state of a block that somebody else has saved: before a swap.
    pub(crate) fn retain_saved(&mut self, block: usize, cells: &[u64], now: u64) {
        let epoch = self.router.epoch();
        let Some(keeping) = &mut self.keeper.keeping else { return };
        let member = keeping.members.iter().position(|m| m.block == block && m.fields == cells.len());
        if let Some(number) = member.filter(|_| !cells.is_empty()) {
            keeping.set(number, cells, now, epoch);
            keeping.keep(false);
        }
    }

    /// Another version of a block, of which there is a recipe already, executes from now on: its state is saved next, also
    /// while a round is under way.
    pub(crate) fn retain_version(&mut self, block: usize, component: &Component) {
        let recipe = &self.supervisor.recipes[block];
        let lane = self.model.blocks[block].lane;
        let Some(keeping) = &mut self.keeper.keeping else { return };
        let Some(number) = keeping.members.iter().position(|m| m.block == block) else { return };
        let member = &mut keeping.members[number];
        let Member { name, place, saved, .. } = &*member;
        *member = Member { saved: *saved, ..Member::new(block, name, *place, component, recipe) };
        keeping.passes[lane].at_once(number);
    }
}

impl Keeping {
    /// Takes a state that was saved at plant time `now`, ns.
    fn set(&mut self, member: usize, cells: &[u64], now: u64, epoch: u64) {
        let member = &mut self.members[member];
        member.saved = Some(now);
        let state = State {
            version: Arc::clone(&member.version),
            time: now,
            wall: epoch.saturating_add(now),
            cells: cells.into(),
        };
        let known = self.states.blocks.get(&member.name);
        if known.is_none_or(|known| !known.same_state(&state)) {
            self.states.blocks.insert(member.name.clone(), Arc::new(state));
            self.changed = true;
        }
    }

    /// Hands over what has changed.
    fn keep(&mut self, round: bool) {
        let changed = std::mem::take(&mut self.changed);
        if changed || round {
            self.vault.keep(changed.then(|| self.states.clone()), round);
        }
    }

    fn close_round(&mut self) {
        if std::mem::take(&mut self.round) {
            self.keep(true);
        }
    }
}
