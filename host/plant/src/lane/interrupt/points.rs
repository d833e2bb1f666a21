//! Points in the lane's own hands: lines that the thread of an interrupt lane reads and writes without another in between.

use super::super::{Lane, LaneState};
use super::Interrupt;
use crate::layout::Probe;
use latchwork_image::Quality;
use latchwork_io::direct::Direct;
use latchwork_io::driver::IoEvent;
use latchwork_record::{Entry, Kind, SourceId};
use std::collections::HashMap;
use std::os::fd::BorrowedFd;
use std::sync::atomic::Ordering;

/// Batches read of a line in a storm at once: more than the kernel keeps.
const STORM_BATCHES: usize = 64;

/// The points of one driver that one interrupt lane serves.
pub struct DirectPart {
    /// The lines.
    pub direct: Box<dyn Direct>,
    /// Inputs.
    pub inputs: Vec<DirectInput>,
    /// Outputs, in the order of the driver's configuration.
    pub outputs: Vec<DirectOutput>,
    /// What the outputs are to show; room for it.
    pub values: Vec<u64>,
    /// Name of the driver as a source of records.
    pub source: SourceId,
    /// Names of its points, for its events.
    pub sources: HashMap<String, SourceId>,
}

/// One input.
pub struct DirectInput {
    /// Place in the configuration.
    pub point: usize,
    /// Cell of the value; that of the quality follows.
    pub cell: u32,
    /// Number in `on`, for an input whose edges start the lane.
    pub edge: Option<u32>,
    /// Its level is read whenever the lane executes: no edges, or only one of both.
    pub level: bool,
}

/// One output.
pub struct DirectOutput {
    /// Place in the configuration.
    pub point: usize,
    /// What it shows.
    pub probe: Probe,
    /// What it shows when the lane does not run.
    pub safe: u64,
}

impl DirectPart {
    pub(super) fn descriptors<'a>(&'a self, in_storm: impl Fn(u32) -> bool, add: &mut impl FnMut(BorrowedFd<'a>)) {
        for input in &self.inputs {
            if input.edge.is_some_and(|e| !in_storm(e))
                && let Some(descriptor) = self.direct.descriptor(input.point)
            {
                add(descriptor);
            }
        }
    }

    /// The points that work: a bit for each input, then for each output; beyond 64 of them bits are shared.
    fn good_points(&self) -> u64 {
        let points = self.inputs.iter().map(|p| p.point).chain(self.outputs.iter().map(|p| p.point));
        points.enumerate().fold(0, |bits, (i, point)| bits | u64::from(self.direct.good(point)) << (i & 63))
    }

    /// Which source an event is about.
    fn source_of(&self, name: &str) -> SourceId {
        self.sources.get(name).copied().unwrap_or(self.source)
    }
}

/// The record of a driver's event.
fn entry(now: u64, source: SourceId, event: &IoEvent) -> Entry {
    Entry::new(now, Kind::Io, source, event.transition).priority(event.priority).text(format_args!("{}", event.text))
}

impl Interrupt {
    /// Shows the level of every input, those that no edge brings as they are now, and how good each is.
    #[inline]
    pub(super) fn read_levels(&mut self, cells: &mut [u64], events: &mut dyn FnMut(SourceId, IoEvent)) {
        for edge in &self.edges {
            let level = edge.now.as_ref().map_or(edge.level, |now| now.load(Ordering::Relaxed));
            cells[edge.cell as usize] = u64::from(level);
        }
        for part in &mut self.points {
            for input in &part.inputs {
                if input.level {
                    let (sources, source) = (&part.sources, part.source);
                    let mut report = |e: IoEvent| events(sources.get(&e.source).copied().unwrap_or(source), e);
                    if let Some(level) = part.direct.level(input.point, &mut report) {
                        cells[input.cell as usize] = u64::from(level);
                    }
                }
                let good = if part.direct.good(input.point) { Quality::Good } else { Quality::Bad }.cell();
                cells[input.cell as usize + 1] = good;
            }
        }
    }
}

impl Lane {
    /// Opens the points that are not open, at plant time `now`; levels of inputs that were opened are read. True when
    /// everything is open.
    pub fn open_points(&mut self, now: u64) -> bool {
        let parts = &mut self.parts;
        let Some(interrupt) = parts.interrupt.as_deref_mut() else { return true };
        let (mut healthy, mut opened) = (true, false);
        for part in &mut interrupt.points {
            if part.direct.healthy() {
                continue;
            }
            let (sources, source, recorder) = (&part.sources, part.source, &mut parts.recorder);
            let mut report = |e: IoEvent| {
                recorder.push(entry(now, sources.get(&e.source).copied().unwrap_or(source), &e));
            };
            let were_good = part.good_points();
            part.direct.open(&mut report);
            let are_good = part.good_points();
            opened |= are_good & !were_good != 0;
            for (i, input) in part.inputs.iter().enumerate() {
                let fresh = (are_good & !were_good) >> (i & 63) & 1 == 1;
                if let (true, Some(number)) = (fresh, input.edge)
                    && let Some(level) = part.direct.level(input.point, &mut report)
                {
                    interrupt.edges[number as usize].level = level;
                }
            }
            healthy &= part.direct.healthy();
        }
        if opened {
            // Inputs show their quality, and outputs what they are to show, with the next execution.
            interrupt.arrivals.tick(now);
        }
        healthy
    }

    /// True when all points are open.
    pub fn points_healthy(&self) -> bool {
        self.parts.interrupt.as_ref().is_none_or(|i| i.points.iter().all(|p| p.direct.healthy()))
    }

    /// Takes edges from the lines, `plant` tells plant time of CLOCK_MONOTONIC; true when there may be more. Lines in a
    /// storm are read only when `all` says so.
    pub fn take_edges(&mut self, now: u64, all: bool, plant: impl Fn(u64) -> u64) -> bool {
        let parts = &mut self.parts;
        let Some(interrupt) = parts.interrupt.as_deref_mut() else { return false };
        let mut more = false;
        for part in &mut interrupt.points {
            for input in &part.inputs {
                let Some(number) = input.edge else { continue };
                let storm = interrupt.arrivals.in_storm(number);
                if storm && !all {
                    continue;
                }
                let was_good = part.direct.good(input.point);
                let (arrivals, recorder) = (&mut interrupt.arrivals, &mut parts.recorder);
                let mut failed = None;
                // A line in a storm is emptied at once: what stays in the kernel would look like a second storm.
                for _ in 0..if storm { STORM_BATCHES } else { 1 } {
                    let again = part.direct.edges(
                        input.point,
                        &mut |edge| arrivals.edge(number, plant(edge.at), edge.level, edge.missed, recorder),
                        &mut |event| failed = Some(event),
                    );
                    more |= again && !storm;
                    if !again {
                        break;
                    }
                }
                if let Some(event) = failed {
                    recorder.push(entry(now, part.source_of(&event.source), &event));
                }
                if was_good && !part.direct.good(input.point) {
                    arrivals.tick(now);
                }
            }
        }
        more
    }

    /// Writes the lane's outputs through its own points: what they show while it runs, their safe values otherwise.
    #[inline]
    pub(in super::super) fn write_points(&mut self, now: u64) {
        let parts = &mut self.parts;
        let Some(interrupt) = parts.interrupt.as_deref_mut() else { return };
        let live = self.state == LaneState::Running;
        for part in &mut interrupt.points {
            for (value, output) in part.values.iter_mut().zip(&part.outputs) {
                *value = if live { output.probe.read(&parts.cells) } else { output.safe };
            }
            let (sources, source, recorder) = (&part.sources, part.source, &mut parts.recorder);
            part.direct.write(&part.values, &mut |e: IoEvent| {
                recorder.push(entry(now, sources.get(&e.source).copied().unwrap_or(source), &e));
            });
        }
    }
}
