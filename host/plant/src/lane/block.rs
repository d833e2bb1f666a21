//! One block in its lane: execution and what follows from it.

use super::{Adapter, Lane, LaneState};
use latchwork_block::{Fault, Instance, Scan};
use latchwork_image::Quality;
use latchwork_record::{Entry, Kind, SourceId};
use std::ops::Range;

/// What a block is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockState {
    /// It executes every scan.
    Running,
    /// It has faulted and waits for its restart.
    Faulted,
    /// It has faulted too often and stays out until an operator acts.
    Parked,
}

/// A block in its lane. What every scan touches comes first.
pub struct Block {
    /// The instance; `None` while the block is out of order.
    pub instance: Option<Instance>,
    /// Plant time of the last execution.
    pub last: u64,
    /// The next execution is the first after a cold start.
    pub first: bool,
    /// It has executed at least once with its present instance or state.
    pub ran: bool,
    /// A plain real output is not finite now.
    pub not_finite: bool,
    /// Somebody listens.
    pub tapped: bool,
    /// Who.
    pub taps: super::Taps,
    /// Its version has another interface than the lane was laid out for.
    pub adapter: Option<Box<Adapter>>,
    /// Argument cells, in the lane's list.
    pub ins: Range<u32>,
    /// Conversions, in the lane's list.
    pub converts: Range<u32>,
    /// Plain real outputs, in the lane's list.
    pub reals: Range<u32>,
    /// Output cells.
    pub out: Range<u32>,
    /// Quality cell.
    pub quality: u32,
    /// Alarms word and its value after the previous execution.
    pub alarms: Option<(u32, u64)>,
    /// First status register and its value after the previous execution; further ones in [`Rest::status`].
    pub status: Option<(u32, u64)>,
    /// Everything that only faults, alarms and operators touch.
    pub rest: Box<Rest>,
}

/// The part of a block that a steady scan does not touch.
pub struct Rest {
    /// Index in the model.
    pub model: usize,
    /// Number of the version that executes; 0 is the plant file's.
    pub version: u64,
    /// Name as a source of records.
    pub source: SourceId,
    /// Names of its alarms as sources, by bit.
    pub alarm_sources: Vec<SourceId>,
    /// Commands word.
    pub commands: Option<u32>,
    /// Status registers, in the order of the class.
    pub status: Vec<super::status::Register>,
    /// One-shot bits that are set.
    pub one_shot: u64,
    /// Quality cells of signal outputs.
    pub qualities: Vec<u32>,
    /// Safe values.
    pub safe: Vec<(u32, u64)>,
    /// Policy after a fault.
    pub on_fault: crate::model::OnFault,
    /// State.
    pub state: BlockState,
    /// Faults in a row.
    pub strikes: u8,
    /// Faults in all.
    pub faults: u64,
    /// Plant time of the last fault.
    pub faulted_at: u64,
    /// Plant time of the restart.
    pub restart_at: u64,
    /// A new instance that waits for its time.
    pub ready: Option<Instance>,
    /// Messages of the block's log.
    pub messages: super::message::Budget,
    /// Executions with a value that was not finite.
    pub not_finite: u64,
    /// What the last saves of its state took.
    pub saves: super::Recent,
}

impl Lane {
    /// Executes a block at plant time `now`, raised to that of its previous execution where an edge came late.
    #[inline]
    pub(super) fn execute(&mut self, index: usize, now: u64) {
        let parts = &mut self.parts;
        let block = &mut parts.blocks[index];
        let Some(instance) = &mut block.instance else { return };
        for c in &parts.converts[block.converts.start as usize..block.converts.end as usize] {
            parts.cells[c.to as usize] = (parts.cells[c.from as usize] >> c.shift & 1) ^ u64::from(c.flip);
        }
        let now = now.max(block.last);
        let scan = Scan { now, elapsed: if block.ran { now - block.last } else { 0 }, first: block.first };
        let ins = &parts.ins[block.ins.start as usize..block.ins.end as usize];
        let result = if block.tapped || block.adapter.is_some() {
            let taps = block.tapped.then_some((&mut block.taps, &mut parts.tape));
            match &mut block.adapter {
                Some(adapter) => adapter.execute(instance, scan, taps, &mut parts.cells),
                None => block.taps.execute(&mut parts.tape, instance, scan, ins, block.out.start, &mut parts.cells),
            }
        } else {
            instance.execute(scan, ins, block.out.start, &mut parts.cells)
        };
        if let Err(fault) = result {
            return self.failed(index, now, &fault);
        }
        block.last = now;
        block.first = false;
        if !block.ran {
            block.ran = true;
            parts.cells[block.quality as usize] = Quality::Good.cell();
        }
        if parts.forces.any() {
            parts.forces.apply(&mut parts.cells, block.quality, block.out.end);
            // Where the block has grown its results stand elsewhere, too. What another block has there is forced already.
            if let Some(results) = block.adapter.as_ref().map(|a| a.results()) {
                parts.forces.apply(&mut parts.cells, results.start, results.end);
            }
        }
    }

    /// A fault of an execution; where a version before waits, that one executes in its place, and so do those of the blocks that
    /// go back with it.
    #[cold]
    fn failed(&mut self, index: usize, now: u64, fault: &Fault) {
        self.back.clear();
        self.block_fault(index, now, fault);
        // What fails from here on is on no probation any more.
        let back = std::mem::take(&mut self.back);
        // Nobody has seen the outputs of this scan: those of an exchange that executed before are made anew, too.
        for before in back.iter().map(|b| *b as usize).filter(|b| *b < index) {
            if self.state == LaneState::Running {
                self.execute(before, now);
                if !self.is_interrupt() {
                    self.report(before, now);
                }
            }
        }
        self.back = back;
        self.back.clear();
        if self.state == LaneState::Running && self.parts.blocks[index].instance.is_some() {
            self.execute(index, now);
        }
    }

    /// What follows from a block's execution besides its outputs: records, at plant time `now`.
    #[inline]
    pub(super) fn report(&mut self, index: usize, now: u64) {
        let parts = &mut self.parts;
        let block = &parts.blocks[index];
        let Some(instance) = &block.instance else { return };
        let reals = match &block.adapter {
            None => &parts.reals[block.reals.start as usize..block.reals.end as usize],
            Some(adapter) => adapter.reals(),
        };
        let not_finite = reals.iter().any(|(cell, mask)| parts.cells[*cell as usize] & mask == *mask);
        let (logged, alarms, status) = (instance.has_log(), block.alarms, block.status);
        if not_finite || block.not_finite {
            self.watch_finite(index, now, not_finite);
        }
        if let Some((cell, previous)) = status
            && (self.parts.cells[cell as usize] != previous || self.parts.blocks[index].rest.status.len() > 1)
        {
            self.status_changed(index, now);
        }
        if let Some((cell, previous)) = alarms
            && self.parts.cells[cell as usize] != previous
        {
            self.alarms_changed(index, now);
        }
        if logged {
            self.take_messages(index, now);
        }
    }

    /// A plain output that is not a number makes the block's outputs bad while it lasts; one record when it begins, one
    /// when it ends.
    #[cold]
    fn watch_finite(&mut self, index: usize, now: u64, not_finite: bool) {
        let block = &mut self.parts.blocks[index];
        let source = block.rest.source;
        if not_finite {
            block.rest.not_finite += 1;
        }
        if not_finite == block.not_finite {
            return;
        }
        block.not_finite = not_finite;
        let count = block.rest.not_finite;
        self.parts.cells[block.quality as usize] = if not_finite { Quality::Bad } else { Quality::Good }.cell();
        let entry = if not_finite {
            Entry::new(now, Kind::Fault, source, "not-finite")
                .priority(100)
                .text(format_args!("an output is NaN or infinite; the block's outputs have quality bad"))
        } else {
            block.rest.not_finite = 0;
            Entry::new(now, Kind::Fault, source, "finite")
                .priority(50)
                .text(format_args!("all outputs are finite again after {count} executions"))
        };
        self.parts.recorder.push(entry);
    }
}
