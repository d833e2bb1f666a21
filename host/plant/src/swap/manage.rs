//! Orders: checked at once, then on their way.

use super::prepare::{From, Job, JobPart};
use super::versions::Release;
use super::{Phase, Shadow, Stage, Swap, SwapOrder, SwapStatus, Swaps, UNDER_WAY};
use crate::assemble::{Plant, Time};
use crate::operate::{Answer, Operator, Refused};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::channel;

/// Largest component, bytes.
const LARGEST: usize = 64 << 20;
/// Beginning of the names of sinks.
const SINK: &str = "sink.";

impl Plant {
    /// Takes an order; the answer tells its number, and what follows goes its way.
    pub(crate) fn swap(&mut self, order: &SwapOrder, operator: &Operator, now: u64) -> Result<Answer, Refused> {
        let (lane, blocks) = self.check_order(order)?;
        let mut parts = Vec::new();
        for (part, block) in order.parts.iter().zip(&blocks) {
            let from = From::Bytes { file: part.file.clone(), bytes: Arc::clone(&part.bytes) };
            parts.push(self.job_part(*block, from, part.settings.clone()));
        }
        let mut job = self.job(parts, order.allow_lossy);
        job.shadow = order.shadow > 0 && !order.dry_run;
        let mut swap = self.begin_swap(operator, lane, blocks, now);
        (swap.shadow, swap.probation, swap.dry_run) = (order.shadow, order.probation, order.dry_run);
        (swap.tolerances, swap.lossy) = (order.tolerances.clone(), order.allow_lossy);
        let files: Vec<_> = order.parts.iter().map(|p| p.file.clone()).collect();
        if !order.dry_run {
            self.tell_asked(&swap, &files, now);
        }
        self.start_swap(swap, job)
    }

    /// The lane and the blocks of an order that can be begun.
    fn check_order(&self, order: &SwapOrder) -> Result<(usize, Vec<usize>), Refused> {
        let Some(first) = order.parts.first() else {
            return Err(Refused::new("value", "there is nothing to swap; name a block and its component"));
        };
        let mut blocks = Vec::new();
        for part in &order.parts {
            if part.block.starts_with(SINK) {
                let message = format!("`{}` is a sink: it is swapped alone, not together with blocks", part.block);
                return Err(Refused::new("state", message));
            }
            let block = self.block(&part.block)?;
            if blocks.contains(&block) {
                return Err(Refused::new("value", format!("`{}` is named twice", part.block)));
            }
            if part.bytes.len() > LARGEST {
                let (found, most) = (part.bytes.len() >> 20, LARGEST >> 20);
                let message = format!("`{}` has {found} MiB; a component of up to {most} MiB is taken", part.file);
                return Err(Refused::new("value", message));
            }
            let (lane, other) = (self.model.blocks[blocks.first().copied().unwrap_or(block)].lane, block);
            if self.model.blocks[other].lane != lane {
                let name = |lane: usize| &self.model.lanes[lane].name;
                let message = format!(
                    "`{}` is in lane `{}`, `{}` in lane `{}`: only blocks of one lane are exchanged in one scan; swap \
                     them one after the other",
                    first.block,
                    name(lane),
                    part.block,
                    name(self.model.blocks[other].lane)
                );
                return Err(Refused::new("value", message));
            }
            blocks.push(block);
        }
        super::shade::check(&order.tolerances)?;
        self.swappable(&blocks)?;
        Ok((self.model.blocks[blocks[0]].lane, blocks))
    }

    /// Refuses blocks whose lane does not run or that are being swapped.
    pub(super) fn swappable(&self, blocks: &[usize]) -> Result<(), Refused> {
        self.lane_runs(self.model.blocks[blocks[0]].lane)?;
        if let Some(swap) = self.swaps.under_way.iter().find(|s| s.blocks.iter().any(|b| blocks.contains(b))) {
            let (number, stage) = (swap.status.number, told(swap.status.stage));
            let message = format!("swap {number} of the same block is {stage}; wait for its end, or call it off");
            return Err(Refused::new("busy", message));
        }
        if self.swaps.under_way.len() >= UNDER_WAY {
            return Err(Refused::new("busy", format!("{UNDER_WAY} swaps are under way; wait for the end of one")));
        }
        Ok(())
    }

    pub(super) fn job_part(&mut self, block: usize, from: From, settings: Vec<(String, String)>) -> JobPart {
        self.swaps.version += 1;
        JobPart {
            block,
            from,
            settings,
            component: self.release(block).component.clone(),
            recipe: self.supervisor.recipes[block].clone(),
            version: self.swaps.version,
        }
    }

    pub(super) fn job(&self, parts: Vec<JobPart>, allow_lossy: bool) -> Job {
        let (engine, model) = (self.engine.clone(), Arc::clone(&self.model));
        Job { engine, model, uses: self.uses(), allow_lossy, shadow: false, parts }
    }

    /// What a block runs, and since when.
    pub(super) fn release(&self, block: usize) -> Release {
        match self.swaps.histories.get(&block) {
            Some(history) => history.current.clone(),
            None => Release {
                component: self.model.blocks[block].component.clone(),
                since: self.router.epoch(),
                by: String::new(),
            },
        }
    }

    /// A swap with the next number.
    pub(super) fn begin_swap(&mut self, operator: &Operator, lane: usize, blocks: Vec<usize>, now: u64) -> Swap {
        self.swaps.number += 1;
        Swap {
            status: SwapStatus {
                number: self.swaps.number,
                stage: Stage::Preparing,
                message: String::new(),
                user: operator.user.clone(),
                asked: self.router.epoch().saturating_add(now),
                blocks: Vec::new(),
                left: 0,
                shadow: Vec::new(),
                prepare_ns: 0,
                exchange_ns: 0,
                exchanged_at: 0,
                saved: false,
            },
            operator: operator.clone(),
            asked: now,
            lane,
            blocks,
            shadow: 0,
            tolerances: Vec::new(),
            lossy: false,
            probation: 0,
            dry_run: false,
            back: false,
            left: Arc::default(),
            phase: Phase::Over,
        }
    }

    /// Has its job done beside the lanes. At virtual time it is done in the next turn: what happens when is the same on every
    /// machine.
    pub(super) fn start_swap(&mut self, mut swap: Swap, job: Job) -> Result<Answer, Refused> {
        swap.phase = match self.time {
            Time::Virtual => Phase::Waiting(Box::new(job)),
            Time::Real => {
                let (done, prepared) = channel();
                // Whoever waits may have been called off.
                let work = move || drop(done.send(job.run()));
                self.swaps.workers.spawn(work).map_err(|why| Refused::new("busy", why))?;
                Phase::Preparing(prepared)
            }
        };
        let answer = Answer::Swap(Box::new(swap.status.clone()));
        self.swaps.under_way.push(swap);
        Ok(answer)
    }

    /// Swaps and how far they are.
    pub(crate) fn swap_list(&self, number: Option<u64>) -> Result<Answer, Refused> {
        let mut rows: Vec<_> = self.swaps.ended.iter().cloned().collect();
        rows.extend(self.swaps.under_way.iter().map(|swap| {
            let mut status = swap.status.clone();
            match &swap.phase {
                Phase::Probation => status.left = swap.left.load(Ordering::Relaxed),
                Phase::Shadow(_, shadows) => {
                    status.left = shadows.iter().map(Shadow::left).max().unwrap_or(0);
                    status.shadow = shadows.iter().map(Shadow::report).collect();
                }
                _ => {}
            }
            status
        }));
        rows.retain(|row| number.is_none_or(|n| row.number == n));
        rows.sort_by_key(|row| row.number);
        match number {
            Some(number) if rows.is_empty() => Err(self.no_swap(number)),
            _ => Ok(Answer::Swaps(rows)),
        }
    }

    fn no_swap(&self, number: u64) -> Refused {
        let last = self.swaps.number;
        let message = if number > 0 && number <= last {
            format!("swap {number} has ended long ago; the records tell of it")
        } else {
            format!("there is no swap {number}; {last} have been ordered since the plant's start")
        };
        Refused::new("unknown", message)
    }

    /// Calls a swap off.
    pub(crate) fn cancel_swap(&mut self, number: u64, operator: &Operator, now: u64) -> Result<Answer, Refused> {
        let Some(at) = self.swaps.under_way.iter().position(|s| s.status.number == number) else {
            let ended = self.swaps.ended.iter().find(|s| s.number == number);
            return Err(match ended {
                Some(swap) => Refused::new("state", format!("swap {number} is over: {}", told(swap.stage))),
                None => self.no_swap(number),
            });
        };
        match self.swaps.under_way[at].phase {
            Phase::Preparing(_) | Phase::Waiting(_) | Phase::Ready(_) | Phase::Shadow(..) => {}
            Phase::Probation => {
                let message = format!("swap {number} is {}; take it back with `rollback`", told(Stage::Probation));
                return Err(Refused::new("state", message));
            }
            Phase::Exchanging(_) | Phase::TakingBack(_) | Phase::Over => {
                return Err(Refused::new("state", format!("swap {number} is on its way to the lane already")));
            }
        }
        let mut swap = self.swaps.under_way.remove(at);
        swap.operator = operator.clone();
        if let Phase::Shadow(_, shadows) = &swap.phase {
            swap.status.shadow = shadows.iter().map(Shadow::report).collect();
            self.end_shadows(swap.lane, shadows);
        }
        self.tell_swap(&swap, "cancelled", "called off before the exchange", now);
        self.swaps.end(swap, Stage::Cancelled, format!("called off by {}", operator.user));
        Ok(Answer::Done { done: vec![format!("swap {number} is called off")] })
    }
}

impl Swaps {
    /// A swap goes no further.
    pub(super) fn end(&mut self, mut swap: Swap, stage: Stage, message: String) {
        swap.status.stage = stage;
        swap.status.left = 0;
        if !message.is_empty() {
            swap.status.message = message;
        }
        self.ended.push_back(swap.status);
        if self.ended.len() > super::ENDED {
            self.ended.pop_front();
        }
    }
}

/// A stage in a sentence.
fn told(stage: Stage) -> &'static str {
    match stage {
        Stage::Preparing => "being prepared",
        Stage::Shadow => "in the shadow",
        Stage::Exchanging => "on its way to the lane",
        Stage::Probation => "on probation",
        Stage::Done => "done",
        Stage::Planned => "planned",
        Stage::Refused => "refused",
        Stage::RolledBack => "rolled back",
        Stage::Cancelled => "called off",
    }
}
