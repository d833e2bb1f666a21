//! The exchange: other versions of some blocks, all or none, between two scans.
//!
//! ```text
//! Request::Exchange ─► measured (the running ones, some executions) ─► save, transfer, restore ─► switched ─► probation ─► back
//!                                                                        any fault: nothing is switched ───────────────────┘
//! ```
//!
//! Everything it needs comes with it and goes back with it: nothing is made or freed in the lane, but what a fault has to say.

use super::{Adapter, BlockState, Growth, Lane, Recent, Report, Tap, TapSlot};
use latchwork_block::upgrade::Transfer;
use latchwork_block::{Fault, Instance};
use latchwork_record::Text;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

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
    pub(super) saves: Recent,
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
            saves: Recent::default(),
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
    /// The recorder's tap of the version that is not in the lane: it goes where its version goes.
    pub tap: Option<Box<Tap>>,
    /// Longest execution of the one that goes, ns; 0: unknown.
    pub baseline: u64,
    /// Executions of the probation that are left.
    pub(super) left: u64,
    /// Time of the executions of this scan, ns.
    pub(super) spent: u64,
    /// The one that went could not save.
    pub(super) failed: Option<Fault>,
    /// Its instance, which is of no more use.
    pub(super) dead: Option<Instance>,
}

impl Exchanging {
    /// A block and what comes.
    pub fn new(block: u32, comes: Standing, carry: Carry, state: Box<[u64]>) -> Self {
        Self {
            block,
            other: comes,
            growth: None,
            carry,
            state,
            state_there: false,
            tap: None,
            baseline: 0,
            left: 0,
            spent: 0,
            failed: None,
            dead: None,
        }
    }

    /// The version that went has faulted: should its turn come again, it gets a new instance.
    pub(super) fn bury(&mut self, now: u64) {
        self.dead = self.other.instance.take();
        (self.other.state, self.other.restart_at) = (BlockState::Faulted, now);
    }
}

/// State of a block that went.
pub struct Handed {
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
    pub saved: Box<[Handed]>,
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

/// Who has an exchange: whoever ordered it can call it off until the lane does it.
#[derive(Debug, Default)]
pub struct Ticket(AtomicU8);

impl Ticket {
    const OPEN: u8 = 0;
    const TAKEN: u8 = 1;
    const CALLED_OFF: u8 = 2;

    /// Calls it off; false when the lane is at it or has done it.
    pub fn call_off(&self) -> bool {
        self.0.compare_exchange(Self::OPEN, Self::CALLED_OFF, Ordering::Relaxed, Ordering::Relaxed).is_ok()
    }

    /// The lane does it now; false when it was called off.
    fn take(&self) -> bool {
        self.0.compare_exchange(Self::OPEN, Self::TAKEN, Ordering::Relaxed, Ordering::Relaxed).is_ok()
    }
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
    /// It may be called off before it is done.
    pub ticket: Arc<Ticket>,
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

    /// Time of the executions of this scan beyond what the versions before took, ns.
    pub(super) fn excess(&self) -> u64 {
        self.parts.iter().map(|p| p.spent.saturating_sub(p.baseline)).fold(0, u64::saturating_add)
    }

    /// Longest execution of the version before of a block of the lane, ns; 0: unknown.
    pub(super) fn baseline(&self, block: usize) -> u64 {
        self.parts.iter().find(|p| p.block as usize == block).map_or(0, |p| p.baseline)
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
            self.list_timed();
            self.exchange(exchange, now, clock);
        }
    }

    fn exchange(&mut self, mut exchange: Box<Exchange>, now: u64, clock: &dyn Fn() -> u64) {
        if !exchange.ticket.take() {
            (exchange.end, exchange.ended) = (End::Refused(Text::new("it was called off")), now);
            return self.send(Report::SwapEnded(exchange));
        }
        let begun = clock();
        let handed = self.hand_over(&mut exchange);
        if handed.is_ok() {
            self.tell_recorder(&mut exchange);
            for part in &mut exchange.parts {
                self.switch(part);
                (part.left, part.spent) = (exchange.probation, 0);
                if part.failed.is_some() {
                    part.bury(now);
                }
            }
            exchange.left.store(exchange.probation, Ordering::Relaxed);
        }
        let took = clock().saturating_sub(begun);
        self.excess = self.excess.saturating_add(took);
        if let Err(why) = handed {
            // Nothing is exchanged, so those that could not save are out of order.
            for part in &exchange.parts {
                if let Some(fault) = &part.failed {
                    self.block_fault(part.block as usize, now, fault);
                }
            }
            (exchange.end, exchange.ended) = (End::Refused(why), now);
            return self.send(Report::SwapEnded(exchange));
        }
        if let Some(mut told) = exchange.told.take() {
            (told.at, told.took) = (now, took);
            self.send(Report::Exchanged(told));
        }
        for part in &exchange.parts {
            if let Some(fault) = &part.failed {
                self.tell_unsaved(part.block as usize, now, fault);
            }
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
    fn hand_over(&mut self, exchange: &mut Exchange) -> Result<(), Text> {
        let Some(told) = exchange.told.as_deref_mut() else { return Ok(()) };
        for (part, saved) in exchange.parts.iter_mut().zip(&mut told.saved) {
            let index = part.block as usize;
            let block = &mut self.parts.blocks[index];
            let runs = block.instance.is_some();
            if let Some(instance) = &mut block.instance {
                match instance.save_into(&mut saved.cells) {
                    Ok(there) => saved.there = there,
                    Err(fault) => {
                        saved.there = false;
                        let why = Text::format(format_args!("the running version could not save: {}", fault.message));
                        part.failed = Some(fault);
                        if matches!(part.carry, Carry::Transfer(_)) {
                            return Err(why);
                        }
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

    /// Those that go say what state they go with, those that come with which they begin: no execution goes unrecorded.
    fn tell_recorder(&mut self, exchange: &mut Exchange) {
        let saved = exchange.told.as_deref().map_or(&[][..], |told| &told.saved);
        for (at, part) in exchange.parts.iter_mut().enumerate() {
            let block = &mut self.parts.blocks[part.block as usize];
            if let Some(tap) = block.taps.recorder() {
                if let Some(saved) = saved.get(at).filter(|s| s.there && (block.ran || !block.first)) {
                    tap.state(block.last, Some(&saved.cells), &mut self.parts.tape);
                }
                tap.waits(&mut self.parts.tape);
            }
            if let Some(tap) = &mut part.tap {
                let warm = !part.other.first || part.other.ran;
                tap.state(part.other.last, warm.then_some(&part.state), &mut self.parts.tape);
            }
        }
    }

    /// The version in the lane and the other one take each other's place.
    pub(super) fn switch(&mut self, part: &mut Exchanging) {
        let index = part.block;
        self.untap(index as usize, TapSlot::Shadow);
        // What was wanted of the version that goes is not asked of the one that comes, which may fail at it.
        self.forget_keyframe(index, TapSlot::Recorder);
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
        std::mem::swap(&mut rest.saves, &mut other.saves);
        block.taps.exchange(&mut part.tap);
        block.tapped = block.taps.any();
        self.waiting.retain(|w| *w != index);
        if rest.state == BlockState::Faulted {
            self.waiting.push(index);
        }
    }

    /// Sends a report; what finds no room goes with the next scan.
    pub(super) fn send(&mut self, report: Report) {
        self.unsent.send(&mut self.parts.reports, report);
    }

    /// Sends what found no room.
    #[cold]
    pub(super) fn send_again(&mut self) {
        self.unsent.send_again(&mut self.parts.reports);
    }
}
