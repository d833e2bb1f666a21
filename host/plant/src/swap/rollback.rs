//! Back to an earlier version because an operator wants it.

use super::prepare::{Back, From};
use super::sinks::SINK;
use super::versions::{Earlier, History};
use super::{BlockPlan, Phase, Stage, Swap, Version, WayBack};
use crate::assemble::Plant;
use crate::lane::Request;
use crate::operate::{Answer, Operator, Refused};
use latchwork_block::upgrade::Difference;

impl Plant {
    /// Puts an earlier version of a block back, with the state it had.
    pub(crate) fn rollback(
        &mut self,
        name: &str,
        to: &WayBack,
        operator: &Operator,
        now: u64,
    ) -> Result<Answer, Refused> {
        if name.starts_with(SINK) {
            let WayBack::Steps(steps) = to else {
                return Err(Refused::new("value", "a sink goes back by a number of versions, `steps`, not by a hash"));
            };
            return self.rollback_sink(name, *steps, operator, now);
        }
        let block = self.block(name)?;
        let lane = self.model.blocks[block].lane;
        self.lane_runs(lane)?;
        to.check()?;
        let on_probation = |s: &&Swap| matches!(s.phase, Phase::Probation) && s.blocks.contains(&block);
        if let Some(at) = self.swaps.under_way.iter().position(|s| on_probation(&s)) {
            return self.take_back(at, block, to, operator, now);
        }
        self.swappable(&[block])?;
        let earlier = match self.swaps.histories.get(&block) {
            Some(history) if !history.earlier.is_empty() => history.way_back(name, to)?,
            _ => {
                let message =
                    format!("`{name}` has no earlier version: it has not been swapped since the plant's start");
                return Err(Refused::new("state", message));
            }
        };
        let wanted = earlier.short();
        // The instance is tried; it stays with the version, as its state does, should that come to nothing.
        let from = From::Earlier(Box::new(Back {
            release: earlier.release.clone(),
            recipe: earlier.recipe.clone(),
            state: earlier.state.clone(),
            instance: earlier.instance.lend(),
        }));
        let part = self.job_part(block, from, Vec::new());
        let job = self.job(vec![part], true);
        let mut swap = self.begin_swap(operator, lane, vec![block], now);
        swap.back = true;
        self.start_swap(swap, job, &[wanted], now)
    }

    /// Ends a probation: the version before still waits in the lane.
    fn take_back(
        &mut self,
        at: usize,
        block: usize,
        to: &WayBack,
        operator: &Operator,
        now: u64,
    ) -> Result<Answer, Refused> {
        let of = self.swaps.under_way[at].status.number;
        let before = self.swaps.histories.get(&block).and_then(|h| h.earlier.back());
        let is_before = match to {
            WayBack::Steps(steps) => *steps == 1,
            WayBack::To(hash) => before.is_some_and(|b| b.release.component.hash().starts_with(hash)),
        };
        if !is_before {
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
        let wanted = |block| Some(self.swaps.histories.get(block)?.earlier.back()?.short());
        let wanted: Vec<_> = swap.blocks.iter().map(|b| wanted(b).unwrap_or_default()).collect();
        self.tell_asked(&swap, &wanted, now);
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

impl WayBack {
    fn check(&self) -> Result<(), Refused> {
        let why = match self {
            Self::Steps(0) => "0 steps back is where it is; 1 is the version before".to_owned(),
            Self::To(hash)
                if hash.is_empty() || !hash.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b)) =>
            {
                format!("\"{}\" is no beginning of a hash; expected digits 0-9 and a-f", hash.escape_debug())
            }
            _ => return Ok(()),
        };
        Err(Refused::new("value", why))
    }
}

impl History {
    /// The version that is meant. Of several with one hash it is the one that was replaced last.
    fn way_back(&self, name: &str, to: &WayBack) -> Result<&Earlier, Refused> {
        let found = match to {
            WayBack::Steps(steps) => {
                let at = usize::try_from(*steps).ok().and_then(|s| self.earlier.len().checked_sub(s));
                at.and_then(|at| self.earlier.get(at)).ok_or_else(|| match self.earlier.len() {
                    1 => format!("`{name}` has one earlier version, not {steps}"),
                    n => format!("`{name}` has {n} earlier versions, not {steps}"),
                })
            }
            WayBack::To(hash) => {
                let mut fitting = self.earlier.iter().rev().filter(|e| e.release.component.hash().starts_with(hash));
                match fitting.next() {
                    Some(first) if fitting.all(|e| e.release.component.hash() == first.release.component.hash()) => {
                        Ok(first)
                    }
                    Some(_) => Err(format!("several earlier versions of `{name}` begin with {hash}; give more digits")),
                    None => {
                        let known: Vec<_> = self.earlier.iter().rev().map(Earlier::short).collect();
                        Err(format!(
                            "no earlier version of `{name}` begins with {hash}; there are {}",
                            known.join(", ")
                        ))
                    }
                }
            }
        };
        found.map_err(|why| Refused::new("state", why))
    }
}

impl Earlier {
    fn short(&self) -> String {
        Version::new(&self.release.component, &self.recipe).short()
    }
}
