//! One lane: its blocks with their places in the image, its queues, what it follows.

use super::Sources;
use crate::lane::{
    Block, BlockState, Condition, Configured, Follower, Interrupt, Lane, LaneParts, Register, Report, Request, Rest,
    RestartRequest, Tracer,
};
use crate::layout::Layout;
use crate::model::Model;
use latchwork_image::{RegionReader, RegionWriter, Type};
use latchwork_record::{Recorder, SourceId};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// What belongs to one lane alone.
pub(super) struct LaneWiring {
    pub(super) index: usize,
    pub(super) region: RegionWriter,
    pub(super) source: SourceId,
    pub(super) recorder: Recorder,
    pub(super) requests: rtrb::Consumer<Request>,
    pub(super) restarts: rtrb::Producer<RestartRequest>,
    pub(super) configured: rtrb::Producer<Configured>,
    pub(super) reports: rtrb::Producer<Report>,
    pub(super) conditions: Vec<Condition>,
    pub(super) tracer: Tracer,
    pub(super) forces: latchwork_image::ForceInbox,
    pub(super) followers: Vec<Follower>,
    pub(super) interrupt: Option<Box<Interrupt>>,
    pub(super) oldest: Arc<AtomicU64>,
    /// First values of single cells.
    pub(super) initial: Vec<(u32, u64)>,
}

impl LaneWiring {
    pub(super) fn lane(
        self,
        model: &Model,
        layout: &Layout,
        regions: &[RegionReader],
        instances: &mut [Option<latchwork_block::Instance>],
        sources: &mut Sources,
    ) -> Lane {
        let (this, config) = (&layout.lanes[self.index], &model.lanes[self.index]);
        let (mut ins, mut converts, mut reals, mut blocks) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for b in &this.blocks {
            let of = &model.blocks[b.block];
            let source = sources.add(of.name.clone());
            let alarm_sources =
                of.class.alarms.iter().map(|a| sources.add(format!("{}.alarms.{a}", of.name))).collect();
            blocks.push(Block {
                instance: instances[b.block].take(),
                last: 0,
                first: true,
                ran: false,
                not_finite: false,
                tapped: false,
                taps: Default::default(),
                adapter: None,
                ins: extend(&mut ins, &b.ins),
                converts: extend(&mut converts, &b.converts),
                reals: extend(&mut reals, &b.reals),
                out: b.out.clone(),
                quality: b.quality,
                alarms: b.alarms.map(|cell| (cell, 0)),
                status: b.status.first().map(|(_, cell)| (*cell, 0)),
                rest: Box::new(Rest {
                    model: b.block,
                    version: 0,
                    source,
                    alarm_sources,
                    commands: b.commands,
                    status: registers(of, &b.status, &mut |name| sources.add(name)),
                    one_shot: 0,
                    qualities: b.qualities.clone(),
                    safe: b.safe.clone(),
                    on_fault: of.on_fault,
                    state: BlockState::Running,
                    strikes: 0,
                    faults: 0,
                    faulted_at: 0,
                    restart_at: 0,
                    ready: None,
                    messages: Default::default(),
                    not_finite: 0,
                    saves: Default::default(),
                }),
            });
        }
        let mut cells = this.cells.clone();
        for (cell, value) in self.initial {
            cells[cell as usize] = value;
        }
        let imports = this.imports.iter().map(|(r, list)| (regions[*r as usize].clone(), list.clone())).collect();
        Lane::new(LaneParts {
            name: config.name.clone(),
            index: self.index,
            every: config.every,
            watchdog: config.watchdog,
            cells,
            used: this.used as usize,
            region: self.region,
            imports,
            blocks,
            ins,
            converts,
            reals,
            forces: self.forces,
            recorder: self.recorder,
            source: self.source,
            requests: self.requests,
            restarts: self.restarts,
            configured: self.configured,
            reports: self.reports,
            conditions: self.conditions,
            tracer: self.tracer,
            tape: Default::default(),
            followers: self.followers,
            interrupt: self.interrupt,
            oldest: self.oldest,
        })
    }
}

/// Appends to a lane-wide list and returns the place.
fn extend<T: Clone>(all: &mut Vec<T>, part: &[T]) -> std::ops::Range<u32> {
    let start = all.len() as u32;
    all.extend_from_slice(part);
    start..all.len() as u32
}

/// The status registers of a block.
pub(crate) fn registers(
    block: &crate::model::Block,
    status: &[(usize, u32)],
    add: &mut dyn FnMut(String) -> SourceId,
) -> Vec<Register> {
    let register = |(port, cell): &(usize, u32)| {
        let port = &block.class.outputs[*port];
        let Type::Flags(names) = &port.ty else { return None };
        let source = add(format!("{}.outputs.{}", block.name, port.path));
        Some(Register { cell: *cell, previous: 0, source, names: names.clone() })
    };
    status.iter().filter_map(register).collect()
}
