//! Whether the state of a version can be saved at all: a spare instance is asked, beside the lanes, before the one at work is.

use super::Recorder;
use crate::assemble::{Plant, Time};
use crate::supervisor::Recipe;
use std::sync::mpsc::{Receiver, channel};

/// Versions that are to be rehearsed, and those that are being.
#[derive(Default)]
pub(super) struct Rehearsals {
    wanted: Vec<(usize, Recipe)>,
    under_way: Vec<Receiver<Rehearsed>>,
}

/// Number of the channel and of the version, and whether its state can be saved.
struct Rehearsed {
    channel: usize,
    version: u64,
    saves: bool,
}

impl Recorder {
    /// A version of a block is to be rehearsed, unless it was.
    pub(super) fn want_rehearsal(&mut self, channel: usize, recipe: &Recipe) {
        if self.channels[channel].want_rehearsal(recipe.version) {
            self.rehearsals.wanted.push((channel, recipe.clone()));
        }
    }
}

impl Plant {
    /// Begins what is wanted and takes what has come of it. At virtual time that is done at once, so that two runs are equal.
    pub(super) fn rehearse(&mut self) {
        let recorder = &mut self.recorder;
        let wanted = std::mem::take(&mut recorder.rehearsals.wanted);
        let tell = |(channel, recipe): &(usize, Recipe)| Rehearsed {
            channel: *channel,
            version: recipe.version,
            saves: recipe.rehearse_save().is_ok(),
        };
        if self.time == Time::Virtual {
            wanted.iter().map(tell).for_each(|r| recorder.channels[r.channel].rehearsed(r.version, r.saves));
            return;
        }
        if !wanted.is_empty() {
            let (done, told) = channel();
            let work = {
                let wanted = wanted.clone();
                move || wanted.iter().map(tell).for_each(|rehearsed| drop(done.send(rehearsed)))
            };
            match self.swaps.aside(work) {
                Ok(()) => recorder.rehearsals.under_way.push(told),
                // The machine has no thread now: without states the recording goes on, and the next turn tries again.
                Err(_) => recorder.rehearsals.wanted = wanted,
            }
        }
        let channels = &mut recorder.channels;
        recorder.rehearsals.under_way.retain(|told| {
            loop {
                match told.try_recv() {
                    Ok(r) => channels[r.channel].rehearsed(r.version, r.saves),
                    Err(why) => return why == std::sync::mpsc::TryRecvError::Empty,
                }
            }
        });
    }
}
