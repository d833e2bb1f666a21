//! Ports that a block gets while its lane runs.

use super::{Adapter, Lane, Register};
use latchwork_image::Quality;
use latchwork_record::SourceId;

/// What a lane has to know of a block's ports when there are more of them: all of them, those that it has and the new ones.
/// After it was taken it holds what went, to be dropped off the lane.
pub struct Growth {
    /// Cells that are published from now on.
    pub used: usize,
    /// Commands word.
    pub commands: Option<u32>,
    /// Alarms word.
    pub alarms: Option<u32>,
    /// Names of the alarms as sources, by bit.
    pub alarm_sources: Vec<SourceId>,
    /// Quality cells of signal outputs.
    pub qualities: Vec<u32>,
    /// Safe values.
    pub safe: Vec<(u32, u64)>,
    /// Status registers.
    pub status: Vec<Register>,
    /// Between the ports and the version that executes now.
    pub adapter: Option<Box<Adapter>>,
}

impl Lane {
    /// Takes a growth.
    #[cold]
    pub(super) fn grow(&mut self, index: usize, growth: &mut Growth) {
        let parts = &mut self.parts;
        let block = &mut parts.blocks[index];
        let rest = &mut *block.rest;
        for (new, known) in growth.status.iter_mut().zip(&rest.status) {
            new.previous = known.previous;
        }
        for quality in &growth.qualities[rest.qualities.len().min(growth.qualities.len())..] {
            parts.cells[*quality as usize] = Quality::Bad.cell();
        }
        rest.commands = growth.commands;
        std::mem::swap(&mut rest.alarm_sources, &mut growth.alarm_sources);
        std::mem::swap(&mut rest.qualities, &mut growth.qualities);
        std::mem::swap(&mut rest.safe, &mut growth.safe);
        std::mem::swap(&mut rest.status, &mut growth.status);
        std::mem::swap(&mut block.adapter, &mut growth.adapter);
        block.alarms = block.alarms.or(growth.alarms.map(|cell| (cell, 0)));
        block.status = block.status.or(rest.status.first().map(|register| (register.cell, register.previous)));
        parts.used = parts.used.max(growth.used);
    }
}
