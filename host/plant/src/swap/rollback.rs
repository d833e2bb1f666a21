//! Back to an earlier version because an operator wants it.

use super::prepare::From;
use super::versions::Earlier;
use super::{BlockPlan, Phase, Stage, Swap};
use crate::assemble::Plant;
use crate::lane::Request;
use crate::operate::{Answer, Operator, Refused};
use latchwork_block::upgrade::Difference;

impl Plant {
    /// Puts an earlier version of a block back, with the state it had.
    pub(crate) fn rollback(
        &mut self,
        name: &str,
        steps: u64,
        operator: &Operator,
        now: u64,
    ) -> Result<Answer, Refused> {
        let block = self.block(name)?;
        let lane = self.model.blocks[block].lane;
        self.lane_runs(lane)?;
        if steps == 0 {
            return Err(Refused::new("value", "0 steps back is where it is; 1 is the version before"));
        }
        let on_probation = |s: &&Swap| matches!(s.phase, Phase::Probation) && s.blocks.contains(&block);
        if let Some(at) = self.swaps.under_way.iter().position(|s| on_probation(&s)) {
            return self.take_back(at, steps, operator, now);
        }
        self.swappable(&[block])?;
        let earlier = self.swaps.histories.get(&block).map_or(0, |h| h.earlier.len());
        let at = usize::try_from(steps).ok().and_then(|s| earlier.checked_sub(s));
        let history = self.swaps.histories.get_mut(&block);
        let Some(earlier) = at.and_then(|at| history?.earlier.get_mut(at)) else {
            let message = match earlier {
                0 => format!("`{name}` has no earlier version: it has not been swapped since the plant's start"),
                1 => format!("`{name}` has one earlier version, not {steps}"),
                n => format!("`{name}` has {n} earlier versions, not {steps}"),
            };
            return Err(Refused::new("state", message));
        };
        // The instance is tried; its state stays with the version, should that come to nothing.
        let from = From::Earlier(Box::new(Earlier {
            release: earlier.release.clone(),
            recipe: earlier.recipe.clone(),
            state: earlier.state.clone(),
            instance: earlier.instance.take(),
        }));
        let part = self.job_part(block, from, Vec::new());
        let job = self.job(vec![part], true);
        let mut swap = self.begin_swap(operator, lane, vec![block], now);
        swap.back = true;
        self.tell_back(&swap, steps, now);
        self.start_swap(swap, job)
    }

    /// Ends a probation: the version before still waits in the lane.
    fn take_back(&mut self, at: usize, steps: u64, operator: &Operator, now: u64) -> Result<Answer, Refused> {
        let of = self.swaps.under_way[at].status.number;
        if steps > 1 {
            let message = format!("swap {of} is on probation; go back one step first, and then further");
            return Err(Refused::new("state", message));
        }
        let taking = |s: &Swap| matches!(s.phase, Phase::TakingBack(number) if number == of);
        if self.swaps.under_way.iter().any(taking) {
            return Err(Refused::new("busy", format!("swap {of} is being taken back already")));
        }
        let lane = self.swaps.under_way[at].lane;
        if self.supervisor.send(lane, Request::TakeBack { number: of }).is_err() {
            return Err(Refused::new("busy", "the lane has not taken earlier requests; does it run?"));
        }
        let (blocks, plans) = (self.swaps.under_way[at].blocks.clone(), &self.swaps.under_way[at].status.blocks);
        let back = |plan: &BlockPlan, block: &usize| {
            let history = self.swaps.histories.get(block)?;
            let (now, then) = (&self.supervisor.recipes[*block], &history.earlier.back()?.recipe);
            Some(BlockPlan {
                block: plan.block.clone(),
                old: plan.new.clone(),
                new: plan.old.clone(),
                ports: Difference::new(now.template.class(), then.template.class()).ports,
                state: Vec::new(),
                settings: Vec::new(),
                broken: Vec::new(),
                notes: vec!["it still waits, with the state that it had".into()],
            })
        };
        let plans = plans.iter().zip(&blocks).filter_map(|(plan, block)| back(plan, block)).collect();
        let mut swap = self.begin_swap(operator, lane, blocks, now);
        swap.back = true;
        (swap.status.blocks, swap.status.stage) = (plans, Stage::Exchanging);
        swap.phase = Phase::TakingBack(of);
        self.tell_back(&swap, steps, now);
        let answer = Answer::Swap(Box::new(swap.status.clone()));
        self.swaps.under_way.push(swap);
        Ok(answer)
    }

    /// A probation has ended because an operator wanted it.
    pub(super) fn taken_back(&mut self, of: Swap, ended: u64) {
        let taking = |s: &Swap| matches!(s.phase, Phase::TakingBack(number) if number == of.status.number);
        let message = match self.swaps.under_way.iter().position(taking) {
            Some(at) => {
                let mut swap = self.swaps.under_way.remove(at);
                swap.status.exchanged_at = ended;
                let (number, user) = (swap.status.number, swap.operator.user.clone());
                self.tell_swap(&swap, "rolled-back", "the version before is back, as it was", ended);
                self.swaps.end(swap, Stage::Done, String::new());
                format!("taken back by {user} with swap {number}")
            }
            None => String::new(),
        };
        self.swaps.end(of, Stage::RolledBack, message);
    }

    /// A probation has ended otherwise before the wish to take it back was heard.
    pub(super) fn not_taken_back(&mut self, of: u64, now: u64) {
        let taking = |s: &Swap| matches!(s.phase, Phase::TakingBack(number) if number == of);
        let Some(at) = self.swaps.under_way.iter().position(taking) else { return };
        let swap = self.swaps.under_way.remove(at);
        let why = format!("the probation of swap {of} ended in the same moment; look at what runs, and try again");
        self.tell_swap(&swap, "refused", &why, now);
        self.swaps.end(swap, Stage::Refused, why);
    }
}
