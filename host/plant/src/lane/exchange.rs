//! The exchange: other versions of some blocks, all or none, between two scans.
//!
//! ```text
//! Request::Exchange ─► measured (the running ones, some executions) ─► save, transfer, restore ─► switched ─► probation ─► back
//!                                                                        any fault: nothing is switched ───────────────────┘
//! ```
//!
//! Everything it needs comes with it and goes back with it: nothing is made or freed in the lane.

use super::{Adapter, BlockState, Growth, Lane, Report};
use latchwork_block::Instance;
use latchwork_block::upgrade::Transfer;
use latchwork_record::Text;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Where the version that comes gets its state from.
pub enum Carry {
    /// From the running one, if that is in order: by name and type, into [`Exchanging::state`], which holds what it starts with.
    Transfer(Box<Transfer>),
    /// From [`Exchanging::state`].
    State,
    /// It has it.
    AsIs,
    /// From nowhere: a cold start.
    Cold,
}

/// A version of a block that does not execute now, and how it stood.
pub struct Standing {
    /// Instance; none of a block that is out of order.
    pub instance: Option<Instance>,
    /// Number of the version.
    pub version: u64,
    /// What it needs when it has another interface than the lane was laid out for.
    pub adapter: Option<Box<Adapter>>,
    pub(super) last: u64,
    pub(super) first: bool,
    pub(super) ran: bool,
    pub(super) state: BlockState,
    pub(super) strikes: u8,
    pub(super) restart_at: u64,
    pub(super) ready: Option<Instance>,
}

impl Standing {
    /// A version that has not executed in this lane.
    pub fn new(instance: Instance, version: u64, adapter: Option<Box<Adapter>>) -> Self {
        Self {
            instance: Some(instance),
            version,
            adapter,
            last: 0,
            first: true,
            ran: false,
            state: BlockState::Running,
            strikes: 0,
            restart_at: 0,
            ready: None,
        }
    }
}

/// One block of an exchange.
pub struct Exchanging {
    /// Index of the block in the lane.
    pub block: u32,
    /// The version that is not in the lane: first the one that comes, after the exchange the one that went.
    pub other: Standing,
    /// Ports that the plant has got for it; the lane takes them whatever becomes of the exchange.
    pub growth: Option<Box<Growth>>,
    /// Where its state comes from.
    pub carry: Carry,
    /// State of the version that comes, one cell per retained field.
    pub state: Box<[u64]>,
    /// [`state`](Self::state) is what it had when an operator took it back.
    pub state_there: bool,
    /// Longest execution of the one that goes, ns; 0: unknown.
    pub baseline: u64,
    /// Executions of the probation that are left.
    pub(super) left: u64,
    /// Time of the executions of this scan, ns.
    pub(super) spent: u64,
}

impl Exchanging {
    /// A block and what comes.
    pub fn new(block: u32, comes: Standing, carry: Carry, state: Box<[u64]>) -> Self {
        Self { block, other: comes, growth: None, carry, state, state_there: false, baseline: 0, left: 0, spent: 0 }
    }
}

/// State of a block that went.
pub struct Saved {
    /// Cells, one per retained field.
    pub cells: Box<[u64]>,
    /// It could be saved.
    pub there: bool,
}

/// It was exchanged.
pub struct Exchanged {
    /// Number of the exchange.
    pub number: u64,
    /// Plant time of the scan that was the new versions' first, ns.
    pub at: u64,
    /// Time it took in the lane, ns.
    pub took: u64,
    /// States of the blocks that went, in the order of the parts.
    pub saved: Box<[Saved]>,
}

/// What became of an exchange.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// It has not ended.
    Open,
    /// Nothing was switched.
    Refused(Text),
    /// The new versions run for good.
    Kept,
    /// They do, before their probation was over: there was no way back any more.
    NoWayBack(Text),
    /// The old versions run again: a fault, or time.
    RolledBack(Text),
    /// The old versions run again: an operator wanted it.
    Returned,
}

/// An exchange on its way.
pub struct Exchange {
    /// Its number.
    pub number: u64,
    /// Its blocks.
    pub parts: Box<[Exchanging]>,
    /// Scans for which the running versions are timed first.
    pub measure: u64,
    /// Executions of each block for which the old one waits; 0: it goes back at once.
    pub probation: u64,
    /// Executions that the probation has before it still, for displays.
    pub left: Arc<AtomicU64>,
    /// What is told of the exchange itself.
    pub told: Option<Box<Exchanged>>,
    /// What became of it.
    pub end: End,
    /// Plant time of the end, ns.
    pub ended: u64,
}

impl Exchange {
    /// The new versions run, and the old ones wait.
    pub(super) fn on_probation(&self) -> bool {
        self.told.is_none()
    }
}

impl Lane {
    /// Takes an exchange in, and does it at once if nothing has to be timed.
    #[cold]
    pub(super) fn take_exchange(&mut self, mut exchange: Box<Exchange>, now: u64, clock: &dyn Fn() -> u64) {
        for part in &mut exchange.parts {
            if let Some(growth) = &mut part.growth {
                self.grow(part.block as usize, growth);
            }
        }
        if exchange.measure == 0 {
            self.exchange(exchange, now, clock);
        } else {
            self.trials.push(exchange);
            self.list_timed();
        }
    }

    /// Does what has been timed long enough.
    #[cold]
    pub(super) fn exchange_measured(&mut self, now: u64, clock: &dyn Fn() -> u64) {
        let due = |e: &Exchange| !e.on_probation() && e.measure == 0;
        while let Some(at) = self.trials.iter().position(|e| due(e)) {
            let exchange = self.trials.swap_remove(at);
            self.exchange(exchange, now, clock);
        }
        self.list_timed();
    }

    fn exchange(&mut self, mut exchange: Box<Exchange>, now: u64, clock: &dyn Fn() -> u64) {
        let begun = clock();
        if let Err(why) = self.hand_over(&mut exchange, now) {
            (exchange.end, exchange.ended) = (End::Refused(why), now);
            return self.send(Report::SwapEnded(exchange));
        }
        for part in &mut exchange.parts {
            self.switch(part);
            (part.left, part.spent) = (exchange.probation, 0);
        }
        exchange.left.store(exchange.probation, Ordering::Relaxed);
        if let Some(mut told) = exchange.told.take() {
            (told.at, told.took) = (now, clock().saturating_sub(begun));
            self.send(Report::Exchanged(told));
        }
        if exchange.probation == 0 {
            (exchange.end, exchange.ended) = (End::Kept, now);
            self.send(Report::SwapEnded(exchange));
        } else {
            self.trials.push(exchange);
            self.list_timed();
        }
    }

    /// State from the running versions to those that come. Nothing is switched yet.
    #[expect(clippy::result_large_err, reason = "a text of fixed size is what a lane can make without allocation")]
    fn hand_over(&mut self, exchange: &mut Exchange, now: u64) -> Result<(), Text> {
        let Some(told) = exchange.told.as_deref_mut() else { return Ok(()) };
        for (part, saved) in exchange.parts.iter_mut().zip(&mut told.saved) {
            let index = part.block as usize;
            let block = &mut self.parts.blocks[index];
            let runs = block.instance.is_some();
            if let Some(instance) = &mut block.instance {
                match instance.save_into(&mut saved.cells) {
                    Ok(there) => saved.there = there,
                    Err(fault) => {
                        let why = Text::format(format_args!("the running version could not save: {}", fault.message));
                        if matches!(part.carry, Carry::Transfer(_)) {
                            self.block_fault(index, now, &fault);
                            return Err(why);
                        }
                        saved.there = false;
                    }
                }
            }
            let warm = match &part.carry {
                Carry::Transfer(transfer) if runs && saved.there => {
                    transfer.apply(&saved.cells, &mut part.state);
                    Some(true)
                }
                Carry::State => Some(true),
                Carry::AsIs => Some(false),
                Carry::Transfer(_) | Carry::Cold => None,
            };
            let comes = &mut part.other;
            if let (Some(true), Some(instance)) = (warm, &mut comes.instance)
                && let Err(fault) = instance.restore(&part.state)
            {
                return Err(Text::format(format_args!("the new version could not restore: {}", fault.message)));
            }
            let block = &self.parts.blocks[index];
            comes.first = warm.is_none();
            comes.last = block.last;
            comes.ran = block.ran && warm.is_some();
        }
        Ok(())
    }

    /// The version in the lane and the other one take each other's place.
    pub(super) fn switch(&mut self, part: &mut Exchanging) {
        let index = part.block;
        self.end_taps(index as usize);
        let (block, other) = (&mut self.parts.blocks[index as usize], &mut part.other);
        let rest = &mut *block.rest;
        std::mem::swap(&mut block.instance, &mut other.instance);
        std::mem::swap(&mut block.adapter, &mut other.adapter);
        std::mem::swap(&mut rest.version, &mut other.version);
        std::mem::swap(&mut block.last, &mut other.last);
        std::mem::swap(&mut block.first, &mut other.first);
        std::mem::swap(&mut block.ran, &mut other.ran);
        std::mem::swap(&mut rest.state, &mut other.state);
        std::mem::swap(&mut rest.strikes, &mut other.strikes);
        std::mem::swap(&mut rest.restart_at, &mut other.restart_at);
        std::mem::swap(&mut rest.ready, &mut other.ready);
        self.waiting.retain(|w| *w != index);
        if rest.state == BlockState::Faulted {
            self.waiting.push(index);
        }
    }

    /// Sends a report; what finds no room goes with the next scan.
    pub(super) fn send(&mut self, report: Report) {
        if let Err(rtrb::PushError::Full(report)) = self.parts.reports.push(report) {
            self.unsent.push(report);
        }
    }

    /// Sends what found no room.
    #[cold]
    pub(super) fn send_again(&mut self) {
        while self.parts.reports.slots() > 0
            && let Some(report) = self.unsent.pop()
        {
            self.send(report);
        }
    }
}
