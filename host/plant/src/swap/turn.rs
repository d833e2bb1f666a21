//! What is under way goes on, a step per turn.

use super::broken::broken;
use super::prepare::{Prepared, Ready};
use super::{Phase, Shadow, Stage, Swap};
use crate::assemble::Plant;
use crate::lane::LaneState;
use crate::layout::STATE;
use std::sync::mpsc::TryRecvError;

/// What a turn makes of a swap.
pub(super) enum Step {
    /// It goes on, or waits.
    On(Swap),
    /// It ends.
    End(Swap, Stage, String),
}

impl Plant {
    /// What is under way goes on, at plant time `now`, ns.
    pub(crate) fn swap_turn(&mut self, now: u64) {
        self.sinks_turn(now);
        self.untap();
        if self.swaps.under_way.is_empty() {
            return;
        }
        self.notice_dead_lanes(now);
        for swap in std::mem::take(&mut self.swaps.under_way) {
            let Some(swap) = self.saving(swap, now) else { continue };
            match self.swap_step(swap, now) {
                Step::On(swap) => self.swaps.under_way.push(swap),
                Step::End(swap, Stage::Planned, message) => self.swaps.end(swap, Stage::Planned, message),
                Step::End(swap, stage, message) => {
                    if !swap.dry_run {
                        self.tell_swap(&swap, "refused", &message, now);
                    }
                    self.swaps.end(swap, stage, message);
                }
            }
        }
    }

    fn swap_step(&mut self, mut swap: Swap, now: u64) -> Step {
        let phase = std::mem::replace(&mut swap.phase, Phase::Over);
        let (prepared, took) = match phase {
            Phase::Waiting(job) => match job.run(&|| true) {
                Some(prepared) => (prepared, 0),
                None => return Step::End(swap, Stage::Refused, "it was given up".into()),
            },
            Phase::Preparing(result, wish) => match result.try_recv() {
                Ok(prepared) => prepared,
                Err(TryRecvError::Empty) => {
                    swap.phase = Phase::Preparing(result, wish);
                    return Step::On(swap);
                }
                Err(TryRecvError::Disconnected) => {
                    return Step::End(swap, Stage::Refused, "it could not be prepared: the compiler has failed".into());
                }
            },
            Phase::Ready(ready) => return self.go_on(swap, ready, now),
            Phase::Shadow(ready, shadows) => return self.shadow_step(swap, ready, shadows, now),
            phase => {
                swap.phase = phase;
                return Step::On(swap);
            }
        };
        self.prepared(swap, prepared, took, now)
    }

    fn prepared(&mut self, mut swap: Swap, prepared: Prepared, took: u64, now: u64) -> Step {
        swap.status.prepare_ns = took;
        swap.status.blocks = prepared.plans;
        let ready = prepared.ready.and_then(|ready| self.has_room(&ready).map(|()| ready));
        match ready {
            Err(why) => Step::End(swap, Stage::Refused, why),
            Ok(_) if swap.dry_run => Step::End(swap, Stage::Planned, String::new()),
            Ok(ready) => self.go_on(swap, ready, now),
        }
    }

    /// To the shadow or to the lane; settings that are on their way to a block come first.
    pub(super) fn go_on(&mut self, mut swap: Swap, mut ready: Vec<Ready>, now: u64) -> Step {
        if swap.blocks.iter().any(|b| self.settings_under_way(*b)) {
            swap.phase = Phase::Ready(ready);
            return Step::On(swap);
        }
        // Operators may have begun something since it was ordered.
        let uses = self.uses();
        let breaks = |part: &Ready| broken(&self.model, &uses, part.block, part.recipe.template.class()).0;
        let breaks: Vec<_> = ready.iter().flat_map(breaks).collect();
        if !breaks.is_empty() {
            return Step::End(swap, Stage::Refused, breaks.join("; "));
        }
        for part in &mut ready {
            if let Err(why) = part.follow(&self.supervisor.recipes[part.block].settings) {
                return Step::End(swap, Stage::Refused, why);
            }
        }
        if ready.iter().any(|r| r.candidate.is_some()) {
            return self.start_shadows(swap, ready, now);
        }
        match self.exchange(&mut swap, ready) {
            Ok(()) => Step::On(swap),
            Err(why) => Step::End(swap, Stage::Refused, why),
        }
    }

    /// Nothing comes back any more from a lane that has ended.
    fn notice_dead_lanes(&mut self, now: u64) {
        let state = |lane: usize| LaneState::from_cell(self.regions[lane].cell(STATE));
        let dead: Vec<_> = self
            .swaps
            .under_way
            .iter()
            // What is being saved is over for the lane.
            .filter(|swap| !matches!(swap.phase, Phase::Saving(_)))
            .map(|swap| swap.lane)
            .filter(|lane| matches!(state(*lane), LaneState::Stopped | LaneState::Faulted))
            .collect();
        if dead.is_empty() {
            return;
        }
        // What it said before it ended is here by now.
        self.lane_reports(now);
        let (ended, on) = std::mem::take(&mut self.swaps.under_way)
            .into_iter()
            .partition(|s| dead.contains(&s.lane) && !matches!(s.phase, Phase::Saving(_)));
        self.swaps.under_way = on;
        for mut swap in ended {
            if let Phase::Shadow(_, shadows) = &swap.phase {
                swap.status.shadow = shadows.iter().map(Shadow::report).collect();
            }
            let why = "its lane has ended";
            let stage = if matches!(swap.phase, Phase::Probation) { Stage::Done } else { Stage::Refused };
            match stage {
                Stage::Done => {
                    self.tell_swap(&swap, "kept", why, now);
                    if !swap.keep.is_empty() {
                        let unproven = "its lane has ended before its probation was over";
                        self.tell_swap(&swap, "not-saved", unproven, now);
                    }
                }
                _ if swap.dry_run => {}
                _ => self.tell_swap(&swap, "refused", why, now),
            }
            self.swaps.end(swap, stage, why.into());
        }
    }
}
