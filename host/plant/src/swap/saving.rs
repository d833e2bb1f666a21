//! `--save`: tried before anything is exchanged, done at the end of a probation; on threads of their own, as everything that
//! waits for a disk.

use super::save::{Keep, Saver};
use super::{Part, Phase, Stage, Swap, Swaps};
use crate::assemble::{Plant, Time};
use latchwork_block::{Component, Engine};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// A save under way.
pub(super) enum Saving {
    /// On its thread.
    There(Receiver<Saved>),
    /// Done.
    Over(Saved),
}

/// What was written, a sentence for each block; or why nothing was.
pub(super) type Saved = Result<Vec<String>, String>;

impl Keep {
    /// What an order brings; its settings are known when it has run.
    pub(super) fn of(part: &Part) -> Self {
        let (block, file, bytes) = (part.block.clone(), part.file.clone(), Arc::clone(&part.bytes));
        Self { block, file, bytes, settings: Vec::new() }
    }
}

/// Whether what is ordered can be saved, as far as can be known beforehand.
pub(super) struct Trial {
    pub(super) saver: Saver,
    pub(super) keep: Vec<Keep>,
    /// Only a plan is wanted.
    pub(super) dry_run: bool,
}

/// What a trial has found.
pub(super) enum Objection {
    /// What could not be saved is not exchanged either.
    Stops(String),
    /// For the plan.
    Note(String),
}

impl Trial {
    /// Finds out. It reads files: not for the plant's own thread.
    pub(super) fn run(&self, engine: &Engine) -> Result<(), Objection> {
        self.saver.try_save(engine, &self.keep).map_err(|why| match self.dry_run {
            true => Objection::Note(format!("it could not be saved: {why}")),
            false => Objection::Stops(format!("it could not be saved: {why}; leave --save out to swap all the same")),
        })
    }
}

impl Saving {
    /// What came of it, once it is over.
    pub(super) fn result(&mut self) -> Option<Saved> {
        match self {
            Self::There(result) => match result.try_recv() {
                Ok(saved) => Some(saved),
                Err(TryRecvError::Empty) => None,
                Err(TryRecvError::Disconnected) => Some(Err("whoever wrote it has failed".into())),
            },
            Self::Over(saved) => Some(saved.clone()),
        }
    }
}

impl Swaps {
    /// Has it written. At virtual time that is done at once, so that two runs are equal.
    pub(super) fn save(&mut self, saver: Saver, engine: Engine, keep: Vec<Keep>, time: Time) -> Saving {
        let work = move || saver.save(&engine, &keep).map_err(|e| e.to_string());
        if time == Time::Virtual {
            return Saving::Over(work());
        }
        let (done, result) = channel();
        match self.workers.save(move || drop(done.send(work()))) {
            Ok(()) => Saving::There(result),
            Err(why) => Saving::Over(Err(why)),
        }
    }
}

impl Plant {
    /// What writes into the plant file.
    pub(super) fn saver(&mut self) -> Saver {
        self.swaps.saver.get_or_insert_with(|| Saver::new(&self.model)).clone()
    }

    /// What finds out whether an order can be saved.
    pub(super) fn trial(&mut self, keep: Vec<Keep>, dry_run: bool) -> Trial {
        Trial { saver: self.saver(), keep, dry_run }
    }

    /// The new versions stay: they are saved if that was wanted, and the swap is done.
    pub(super) fn stays(&mut self, mut swap: Swap, message: String, now: u64) {
        if swap.keep.is_empty() {
            return self.swaps.end(swap, Stage::Done, message);
        }
        swap.status.message = message;
        for (block, keep) in swap.blocks.iter().zip(&mut swap.keep) {
            let recipe = &self.supervisor.recipes[*block];
            let ports = recipe.template.class().settings.iter().map(|p| p.path.clone());
            keep.settings = ports.zip(recipe.settings.iter().copied()).collect();
        }
        let (saver, engine, keep) = (self.saver(), self.engine.clone(), swap.keep.clone());
        swap.phase = Phase::Saving(self.swaps.save(saver, engine, keep, self.time));
        if let Some(swap) = self.saving(swap, now) {
            self.swaps.under_way.push(swap);
        }
    }

    /// A swap that is being saved, unless that is over.
    pub(super) fn saving(&mut self, mut swap: Swap, now: u64) -> Option<Swap> {
        let Phase::Saving(saving) = &mut swap.phase else { return Some(swap) };
        match saving.result() {
            None => return Some(swap),
            Some(Ok(sentences)) => {
                swap.status.saved = true;
                for (block, keep) in swap.blocks.iter().zip(&swap.keep) {
                    self.swaps.of_file.insert(*block, Component::hash_of(&keep.bytes));
                }
                self.tell_swap(&swap, "saved", &sentences.join("; "), now);
                self.settings_saved(&swap, now);
                let message = swap.status.message.clone();
                self.swaps.end(swap, Stage::Done, message);
            }
            Some(Err(why)) => {
                self.tell_swap(&swap, "not-saved", &why, now);
                self.swaps.end(swap, Stage::Done, format!("the new version stays, but it was not saved: {why}"));
            }
        }
        None
    }
}
