//! Orders: checked at once, then on their way.

use super::prepare::{From, Job, JobPart};
use super::save::Keep;
use super::sinks::SINK;
use super::versions::Release;
use super::workers::Wish;
use super::{Phase, Shadow, Stage, Swap, SwapOrder, SwapStatus, Swaps, UNDER_WAY};
use crate::assemble::{Plant, Time};
use crate::operate::{Answer, Operator, Refused};
use crate::run::{Clock, MachineClock};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::channel;

impl Plant {
    /// Takes an order; the answer tells its number, and what follows goes its way.
    pub(crate) fn swap(&mut self, order: &SwapOrder, operator: &Operator, now: u64) -> Result<Answer, Refused> {
        if order.parts.iter().any(|p| p.block.starts_with(SINK)) {
            return self.swap_sink(order, operator, now);
        }
        let (lane, blocks) = self.check_order(order)?;
        let mut parts = Vec::new();
        for (part, block) in order.parts.iter().zip(&blocks) {
            let from = From::Bytes { file: part.file.clone(), bytes: Arc::clone(&part.bytes) };
            parts.push(self.job_part(*block, from, part.settings.clone()));
        }
        let mut job = self.job(parts, order.allow_lossy);
        job.shadow = order.shadow > 0 && !order.dry_run;
        let keep: Vec<_> = order.parts.iter().filter(|_| order.save).map(Keep::of).collect();
        job.save = order.save.then(|| self.trial(keep.clone(), order.dry_run));
        let mut swap = self.begin_swap(operator, lane, blocks, now);
        (swap.shadow, swap.probation, swap.dry_run) = (order.shadow, order.probation, order.dry_run);
        (swap.tolerances, swap.lossy) = (order.tolerances.clone(), order.allow_lossy);
        if !order.dry_run {
            swap.keep = keep;
        }
        let files: Vec<_> = order.parts.iter().map(|p| p.file.clone()).collect();
        self.start_swap(swap, job, &files, now)
    }

    /// The lane and the blocks of an order that can be begun.
    fn check_order(&self, order: &SwapOrder) -> Result<(usize, Vec<usize>), Refused> {
        let Some(first) = order.parts.first() else {
            return Err(Refused::new("value", "there is nothing to swap; name a block and its component"));
        };
        let mut blocks = Vec::new();
        for part in &order.parts {
            let block = self.block(&part.block)?;
            if blocks.contains(&block) {
                return Err(Refused::new("value", format!("`{}` is named twice", part.block)));
            }
            part.not_too_large()?;
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
        self.tolerances_name_outputs(&order.tolerances, &blocks)?;
        self.swappable(&blocks)?;
        // From here on nothing else comes between: a block has one swap under way.
        for (part, block) in order.parts.iter().zip(&blocks) {
            part.takes_place_of(self.release(*block).component.hash())?;
        }
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
        self.has_workers()
    }

    /// Refuses what would be one too many at once, of blocks and sinks together.
    pub(super) fn has_workers(&self) -> Result<(), Refused> {
        if self.swaps.under_way.len() + self.swaps.of_sinks.len() >= UNDER_WAY {
            return Err(Refused::new("busy", format!("{UNDER_WAY} swaps are under way; wait for the end of one")));
        }
        // A compiler cannot be stopped: what was called off counts until it has noticed.
        if self.swaps.workers.unfinished() >= UNDER_WAY {
            let message =
                format!("{UNDER_WAY} swaps are being prepared, some of them called off; wait for the end of one");
            return Err(Refused::new("busy", message));
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
        let timed = self.time == Time::Real;
        Job { engine, model, timed, uses: self.uses(), allow_lossy, shadow: false, save: None, parts }
    }

    /// The component that a block runs.
    pub(crate) fn component_of(&self, block: usize) -> latchwork_block::Component {
        self.release(block).component
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
        Swap {
            status: self.swap_status(operator, now),
            operator: operator.clone(),
            lane,
            blocks,
            shadow: 0,
            tolerances: Vec::new(),
            lossy: false,
            probation: 0,
            dry_run: false,
            keep: Vec::new(),
            back: false,
            left: Arc::default(),
            ticket: Arc::default(),
            phase: Phase::Over,
        }
    }

    /// The state of a swap that begins, with the next number.
    pub(super) fn swap_status(&mut self, operator: &Operator, now: u64) -> SwapStatus {
        self.swaps.number += 1;
        SwapStatus {
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
        }
    }

    /// Has its job done beside the lanes. At virtual time it is done in the next turn: what happens when is the same on every
    /// machine. What is asked for is on record once somebody is at it: of each block what is to run.
    pub(super) fn start_swap(
        &mut self,
        mut swap: Swap,
        job: Job,
        wanted: &[String],
        now: u64,
    ) -> Result<Answer, Refused> {
        swap.phase = match self.time {
            Time::Virtual => Phase::Waiting(Box::new(job)),
            Time::Real => {
                let (done, prepared) = channel();
                let wish = Wish::default();
                let wanted = wish.watch();
                // Whoever waits may have been called off.
                let work = move || {
                    let clock = MachineClock::start();
                    if let Some(prepared) = job.run(&|| wanted.stands()) {
                        drop(done.send((prepared, clock.now())));
                    }
                };
                self.swaps.workers.spawn(work).map_err(|why| Refused::new("busy", why))?;
                Phase::Preparing(prepared, wish)
            }
        };
        if !swap.dry_run {
            self.tell_asked(&swap, wanted, now);
        }
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
        rows.extend(self.swaps.of_sinks.iter().map(|swap| swap.status.clone()));
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
        if let Some(answer) = self.cancel_sink(number, operator, now) {
            return answer;
        }
        let Some(at) = self.swaps.under_way.iter().position(|s| s.status.number == number) else {
            let ended = self.swaps.ended.iter().find(|s| s.number == number);
            return Err(match ended {
                Some(swap) => Refused::new("state", format!("swap {number} is over: {}", told(swap.stage))),
                None => self.no_swap(number),
            });
        };
        match self.swaps.under_way[at].phase {
            Phase::Preparing(..) | Phase::Waiting(_) | Phase::Ready(_) | Phase::Shadow(..) => {}
            // The lane sends back what it does not do.
            Phase::Exchanging(_) if self.swaps.under_way[at].ticket.call_off() => {}
            Phase::Probation => {
                let message = format!("swap {number} is {}; take it back with `rollback`", told(Stage::Probation));
                return Err(Refused::new("state", message));
            }
            Phase::Saving(_) => {
                return Err(Refused::new("state", format!("swap {number} is over, and is being saved")));
            }
            Phase::Exchanging(_) | Phase::TakingBack(_) | Phase::Over => {
                return Err(Refused::new("state", format!("swap {number} is being done in the lane")));
            }
        }
        let mut swap = self.swaps.under_way.remove(at);
        swap.operator = operator.clone();
        if let Phase::Shadow(_, shadows) = &swap.phase {
            swap.status.shadow = shadows.iter().map(Shadow::report).collect();
            self.end_shadows(swap.lane, shadows);
        }
        let prepares = matches!(swap.phase, Phase::Preparing(..));
        self.tell_swap(&swap, "cancelled", "called off before the exchange", now);
        // What is still prepared of it is wanted by nobody from here on, and goes nowhere.
        self.swaps.end(swap, Stage::Cancelled, format!("called off by {}", operator.user));
        if prepares {
            self.swaps.workers.leave();
        }
        Ok(Answer::Done { done: vec![format!("swap {number} is called off")] })
    }
}

impl Swaps {
    /// A swap goes no further.
    pub(super) fn end(&mut self, mut swap: Swap, stage: Stage, message: String) {
        swap.status.stage = stage;
        swap.status.left = 0;
        if let Phase::Exchanging(coming) = std::mem::replace(&mut swap.phase, Phase::Over) {
            self.not_done.push_back((swap.status.number, swap.blocks, coming));
            if self.not_done.len() > UNDER_WAY {
                self.not_done.pop_front();
            }
        }
        if !message.is_empty() {
            swap.status.message = message;
        }
        self.over(swap.status);
    }

    /// The same for its state alone.
    pub(super) fn over(&mut self, status: SwapStatus) {
        self.ended.push_back(status);
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
