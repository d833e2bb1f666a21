//! Saving the state of a block, between two scans and outside of the time that a scan has.
//!
//! One block at a time: a request waits in the lane until there is time left before the next scan, but not for ever. Its
//! cells come with it and go back, so that nothing is allocated or freed here. The states that taps begin with are saved
//! here, too.

use super::{Lane, LaneState, Report, TapSlot};
use latchwork_block::Fault;

/// A state is put off for no longer than this, ns of plant time: a lane without any time left is late by one save then.
pub const PUT_OFF: u64 = 1_000_000_000;
/// What a save is expected to take at least, ns.
const FIRST: u64 = 10_000;
/// Saves whose cost is remembered: one that was interrupted does not put later ones off for ever.
const RECENT: usize = 8;

/// What the last saves of a version took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recent {
    took: [u64; RECENT],
    at: usize,
}

impl Recent {
    /// One more took so long, ns.
    pub fn add(&mut self, took: u64) {
        self.took[self.at] = took;
        self.at = (self.at + 1) % RECENT;
    }

    /// The longest of the last eight, ns; 0 before the first.
    pub fn longest(&self) -> u64 {
        self.took.iter().copied().max().unwrap_or(0)
    }
}

/// Wanted: the state of a block.
pub struct Save {
    /// Index of the block in the lane.
    pub block: u32,
    /// Number of the version that it is wanted of.
    pub version: u64,
    /// One per retained field.
    pub cells: Box<[u64]>,
}

/// How it went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveResult {
    /// The cells hold the state.
    Saved,
    /// The block is out of order, or another version of it executes by now.
    Nothing,
    /// Another request waits already.
    Busy,
    /// It failed: a fault of the block like any other.
    Faulted,
}

/// The answer to a [`Save`].
pub struct SaveAnswer {
    /// What was asked, with its cells.
    pub save: Save,
    /// How it went.
    pub result: SaveResult,
    /// Plant time, ns.
    pub time: u64,
    /// How long it took, ns.
    pub took: u64,
}

/// A request that waits for its time.
pub(super) struct Waiting {
    save: Save,
    /// Plant time since when, ns.
    since: u64,
}

/// A tap that waits for the state of its block.
pub(super) struct Keyframe {
    block: u32,
    slot: TapSlot,
    /// Plant time since when, ns.
    since: u64,
}

impl Lane {
    /// Room for one state per tap.
    pub(super) const KEYFRAMES_PER_BLOCK: usize = 2;

    /// A tap is to get the state of its block when there is time.
    pub(super) fn want_keyframe(&mut self, block: u32, slot: TapSlot, now: u64) {
        if !self.keyframes.iter().any(|k| (k.block, k.slot) == (block, slot)) {
            self.keyframes.push(Keyframe { block, slot, since: now });
        }
    }

    /// Nobody waits for this state any more.
    pub(super) fn forget_keyframe(&mut self, block: u32, slot: TapSlot) {
        self.keyframes.retain(|k| (k.block, k.slot) != (block, slot));
    }

    /// Takes a request; it is done when there is time.
    pub(super) fn take_save(&mut self, save: Save, now: u64) {
        if self.saving.is_none() {
            self.saving = Some(Waiting { save, since: now });
        } else {
            self.answer(SaveAnswer { save, result: SaveResult::Busy, time: now, took: 0 });
        }
    }

    /// Between two scans: saves the state of one block if one is wanted and there is time before `until` (plant time, ns).
    /// An interrupt lane takes its requests first: an exchange, settings and commands wait for no edge.
    /// Returns the lane's state: a block that fails may stop it.
    pub fn spare(&mut self, until: u64, clock: impl Fn() -> u64) -> LaneState {
        // A lane that waits for an edge may wait for hours, and has better to do when it comes; a cyclic one takes its
        // requests with the next scan.
        if self.is_interrupt()
            && self.state == LaneState::Running
            && (!self.parts.requests.is_empty() || !self.unsent.is_empty())
        {
            self.take_idle(&clock);
        }
        if (self.saving.is_some() || !self.keyframes.is_empty()) && self.state == LaneState::Running {
            self.save_one(until, &clock);
        }
        self.state
    }

    /// Saves the state that has been waited for longest.
    #[cold]
    fn save_one(&mut self, until: u64, clock: &dyn Fn() -> u64) {
        let now = clock();
        let saving = self.saving.as_ref().map(|w| (w.save.block, w.since));
        let keyframe = self.keyframes.first().map(|k| (k.block, k.since));
        let of_tap = saving.is_none_or(|(_, since)| keyframe.is_some_and(|(_, tap_since)| tap_since < since));
        let next = if of_tap { keyframe } else { saving };
        let Some((block, since)) = next else { return };
        let longest = self.parts.blocks.get(block as usize).map_or(0, |b| b.rest.saves.longest());
        // Twice what it has taken lately: the caches are cold, and it must not be the scan that pays.
        let in_time = until.saturating_sub(now) >= longest.max(FIRST).saturating_mul(2);
        if !in_time && now.saturating_sub(since) < PUT_OFF {
            return;
        }
        // A fault makes a record.
        self.mark(now);
        if of_tap {
            let Keyframe { block, slot, .. } = self.keyframes.remove(0);
            self.save_for_tap(block as usize, slot, now, clock);
        } else if let Some(waiting) = self.saving.take() {
            self.save_waiting(waiting, now, clock);
        }
        if self.is_interrupt() {
            self.mark_oldest();
        } else {
            self.mark(u64::MAX);
        }
    }

    fn save_for_tap(&mut self, index: usize, slot: TapSlot, now: u64, clock: &dyn Fn() -> u64) {
        let Some(block) = self.parts.blocks.get_mut(index) else { return };
        let saved = block.save_for(slot, &mut self.parts.tape);
        block.rest.saves.add(clock().saturating_sub(now));
        if let Err(fault) = saved {
            self.could_not_save(index, now, &fault);
        }
    }

    /// A fault between two scans: the others see at once what becomes of it.
    fn could_not_save(&mut self, index: usize, now: u64, fault: &Fault) {
        self.block_fault(index, now, fault);
        self.publish_state(now);
        self.write_points(now);
    }

    fn save_waiting(&mut self, waiting: Waiting, now: u64, clock: &dyn Fn() -> u64) {
        let Waiting { mut save, .. } = waiting;
        let block = self.parts.blocks.get_mut(save.block as usize);
        let (mut result, mut took) = (SaveResult::Nothing, 0);
        let block = block.filter(|b| b.rest.version == save.version);
        if let Some(instance) = block.and_then(|b| b.instance.as_mut())
            && instance.class().retained.len() == save.cells.len()
        {
            let saved = instance.save_into(&mut save.cells);
            took = clock().saturating_sub(now);
            result = match saved {
                Ok(true) => SaveResult::Saved,
                Ok(false) => SaveResult::Nothing,
                Err(fault) => {
                    self.could_not_save(save.block as usize, now, &fault);
                    SaveResult::Faulted
                }
            };
            self.parts.blocks[save.block as usize].rest.saves.add(took);
        }
        self.answer(SaveAnswer { save, result, time: now, took });
    }

    fn answer(&mut self, saved: SaveAnswer) {
        self.send(Report::Saved(saved));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_save_took_counts_for_the_next_eight() {
        let mut recent = Recent::default();
        assert_eq!(recent.longest(), 0);
        recent.add(9_000_000);
        (0..RECENT - 1).for_each(|_| recent.add(5));
        assert_eq!(recent.longest(), 9_000_000);
        recent.add(7);
        assert_eq!(recent.longest(), 7);
    }
}
