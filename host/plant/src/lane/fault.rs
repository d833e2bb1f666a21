//! Faults: of a block, contained by its policy, and of the lane itself.

use super::{Block, BlockState, Lane, LaneState, RestartRequest};
use crate::model::OnFault;
use latchwork_block::{Fault, FaultKind};
use latchwork_image::Quality;
use latchwork_record::{Datum, Entry, Kind};
use std::fmt::Arguments;

/// Faults in a row after which a block is parked.
pub const STRIKES: u8 = 3;
/// Time from the first and the second fault in a row to the restart, ns of plant time.
pub const BACK_OFF: [u64; 2] = [100_000_000, 1_000_000_000];
/// Plant time without a fault after which the strikes are forgotten, ns.
const FORGIVEN_AFTER: u64 = 60_000_000_000;
/// Priority of the record of a fault.
const PRIORITY: u8 = 200;

impl Lane {
    /// Contains a fault of one block: outputs by policy, quality bad, one record, restart or parking.
    #[cold]
    pub(super) fn block_fault(&mut self, index: usize, now: u64, fault: &Fault) {
        if self.fault_on_trial(index, now, fault) {
            return;
        }
        self.contain(index, now, fault.kind, &fault.message);
        let parts = &mut self.parts;
        let block = &mut parts.blocks[index];
        let dead = block.instance.take();
        if block.rest.state == BlockState::Faulted {
            let (model, version) = (block.rest.model, block.rest.version);
            let request = RestartRequest { block: index as u32, model, version, dead };
            // The queue holds one place per block, and a block asks only once at a time.
            let _ = parts.restarts.push(request);
        } else {
            let _ = parts.restarts.push(RestartRequest::dead(&block.rest, dead));
        }
    }

    /// Strikes, policy, quality and record of a fault.
    pub(super) fn contain(&mut self, index: usize, now: u64, kind: FaultKind, message: &str) {
        self.statistics.faults += 1;
        let parts = &mut self.parts;
        let block = &mut parts.blocks[index];
        let rest = &mut *block.rest;
        if rest.strikes > 0 && now.saturating_sub(rest.faulted_at) > FORGIVEN_AFTER {
            rest.strikes = 0;
        }
        rest.strikes += 1;
        rest.faults += 1;
        rest.faulted_at = now;
        rest.ready = None;
        // The execution that failed has seen its one-shot commands: the next instance must not get them again.
        if let Some(cell) = rest.commands {
            parts.cells[cell as usize] &= !rest.one_shot;
            rest.one_shot = 0;
        }
        put_out(block, &mut parts.cells);
        let rest = &mut *block.rest;
        let outputs = match rest.on_fault {
            OnFault::Hold => "outputs hold their last values",
            OnFault::Safe => "outputs take their safe values",
            OnFault::StopLane => "the lane stops",
        };
        let entry = Entry::new(now, Kind::Fault, rest.source, kind.name())
            .priority(PRIORITY)
            .change(Datum::None, Datum::Integer(rest.strikes.into()));
        let entry = if rest.on_fault == OnFault::StopLane {
            rest.state = BlockState::Parked;
            entry.text(format_args!("{outputs}: {message}"))
        } else if rest.strikes >= STRIKES {
            rest.state = BlockState::Parked;
            entry.text(format_args!("{outputs}; parked after {STRIKES} faults in a row: {message}"))
        } else {
            rest.state = BlockState::Faulted;
            let back_off = BACK_OFF[usize::from(rest.strikes - 1).min(BACK_OFF.len() - 1)];
            rest.restart_at = now.saturating_add(back_off);
            let (n, ms) = (rest.strikes, back_off / 1_000_000);
            entry.text(format_args!("{outputs}; restart in {ms} ms (fault {n} of {STRIKES}): {message}"))
        };
        let state = rest.state;
        let stop = rest.on_fault == OnFault::StopLane;
        parts.recorder.push(entry);
        // Safe values may be another register.
        self.status_changed(index, now);
        if state == BlockState::Faulted {
            self.waiting.push(index as u32);
        }
        if stop {
            self.fail(now, format_args!("a block with on-fault = \"stop-lane\" has faulted"));
        }
    }

    /// A fault of the lane: it stops, every output takes its safe value with quality bad.
    #[cold]
    pub(super) fn fail(&mut self, now: u64, why: Arguments<'_>) {
        self.state = LaneState::Faulted;
        self.statistics.faults += 1;
        let parts = &mut self.parts;
        for block in &parts.blocks {
            for (cell, value) in &block.rest.safe {
                parts.cells[*cell as usize] = *value;
            }
            for cell in block.rest.qualities.iter().chain([&block.quality]) {
                parts.cells[*cell as usize] = Quality::Bad.cell();
            }
        }
        let entry = Entry::new(now, Kind::Lane, parts.source, "faulted").priority(255);
        parts.recorder.push(entry.text(format_args!("{why}; outputs take their safe values")));
        for index in 0..self.parts.blocks.len() {
            self.status_changed(index, now);
        }
        self.settle_arrivals(now);
    }
}

/// Quality and outputs of a block that is out of order, by its policy.
pub(super) fn put_out(block: &mut Block, cells: &mut [u64]) {
    block.ran = false;
    block.not_finite = false;
    for cell in block.rest.qualities.iter().chain([&block.quality]) {
        cells[*cell as usize] = Quality::Bad.cell();
    }
    if block.rest.on_fault != OnFault::Hold {
        for (cell, value) in &block.rest.safe {
            cells[*cell as usize] = *value;
        }
    }
}
