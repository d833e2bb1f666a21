//! Points in the lane's own hands: lines that the thread of an interrupt lane reads and writes without another in between.

use super::super::{Lane, LaneState};
use super::Interrupt;
use crate::layout::Probe;
use latchwork_image::Quality;
use latchwork_io::direct::Direct;
use latchwork_io::driver::IoEvent;
use latchwork_record::{Entry, Kind, Recorder, SourceId};
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
    /// Sources of records.
    pub names: DirectNames,
}

/// A driver and its points as sources of records.
pub struct DirectNames {
    /// The driver.
    pub driver: SourceId,
    /// Its points, by name.
    pub points: HashMap<String, SourceId>,
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
    /// It worked when lines were last opened.
    pub good: bool,
}

/// One output.
pub struct DirectOutput {
    /// Place in the configuration.
    pub point: usize,
    /// What it shows.
    pub probe: Probe,
    /// What it shows when the lane does not run.
    pub safe: u64,
    /// It worked when lines were last opened.
    pub good: bool,
}

impl DirectNames {
    /// The record of a driver's event.
    fn entry(&self, now: u64, event: &IoEvent) -> Entry {
        let source = self.points.get(&event.source).copied().unwrap_or(self.driver);
        Entry::new(now, Kind::Io, source, event.transition)
            .priority(event.priority)
            .text(format_args!("{}", event.text))
    }
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
}

impl Interrupt {
    /// Shows the level of every input, those that no edge brings as they are now, and how good each is. True when a level
    /// that no edge brings, or a quality, is another one than the cells showed.
    #[inline]
    pub(super) fn read_levels(&mut self, cells: &mut [u64], now: u64, recorder: &mut Recorder) -> bool {
        let mut changed = false;
        let mut told = false;
        for edge in &self.edges {
            let level = edge.now.as_ref().map_or(edge.level, |now| now.load(Ordering::Relaxed));
            let cell = &mut cells[edge.cell as usize];
            changed |= edge.now.is_some() && *cell != u64::from(level);
            *cell = u64::from(level);
            if let Some(quality) = &edge.quality {
                let (cell, quality) = (&mut cells[edge.cell as usize + 1], quality.load(Ordering::Relaxed));
                changed |= *cell != quality;
                *cell = quality;
            }
        }
        for part in &mut self.points {
            for input in &part.inputs {
                let (value, quality) = (input.cell as usize, input.cell as usize + 1);
                if input.level {
                    let names = &part.names;
                    let mut report = |e: IoEvent| {
                        told = true;
                        recorder.push(names.entry(now, &e));
                    };
                    if let Some(level) = part.direct.level(input.point, &mut report) {
                        changed |= cells[value] != u64::from(level);
                        cells[value] = u64::from(level);
                    }
                }
                let good = if part.direct.good(input.point) { Quality::Good } else { Quality::Bad }.cell();
                changed |= cells[quality] != good;
                cells[quality] = good;
            }
        }
        if told {
            // Inputs read before the one that failed show a quality that is over.
            self.arrivals.tick(now);
        }
        changed
    }
}

impl Lane {
    /// True for a lane with levels that no edge brings: other lanes see them only when this one shows them.
    pub fn has_levels(&self) -> bool {
        let Some(interrupt) = &self.parts.interrupt else { return false };
        interrupt.edges.iter().any(|e| e.now.is_some())
            || interrupt.points.iter().any(|p| p.inputs.iter().any(|i| i.level))
    }

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
            let (names, recorder) = (&part.names, &mut parts.recorder);
            let mut report = |e: IoEvent| recorder.push(names.entry(now, &e));
            part.inputs.iter_mut().for_each(|i| i.good = part.direct.good(i.point));
            part.outputs.iter_mut().for_each(|o| o.good = part.direct.good(o.point));
            part.direct.open(&mut report);
            for input in &mut part.inputs {
                let good = part.direct.good(input.point);
                if std::mem::replace(&mut input.good, good) || !good {
                    continue;
                }
                opened = true;
                if let Some(number) = input.edge
                    && let Some(level) = part.direct.level(input.point, &mut report)
                {
                    interrupt.edges[number as usize].level = level;
                }
            }
            for output in &mut part.outputs {
                let good = part.direct.good(output.point);
                opened |= good && !std::mem::replace(&mut output.good, good);
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

    /// Looks after lines of which nothing has been heard, at plant time `now`; once a second is often enough.
    pub fn check_points(&mut self, now: u64) {
        let parts = &mut self.parts;
        let Some(interrupt) = parts.interrupt.as_deref_mut() else { return };
        let mut told = false;
        for part in &mut interrupt.points {
            let (names, recorder) = (&part.names, &mut parts.recorder);
            part.direct.check(&mut |e: IoEvent| {
                told = true;
                recorder.push(names.entry(now, &e));
            });
        }
        if told {
            interrupt.arrivals.tick(now);
        }
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
                    recorder.push(part.names.entry(now, &event));
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
        let mut told = false;
        for part in &mut interrupt.points {
            for (value, output) in part.values.iter_mut().zip(&part.outputs) {
                *value = if live { output.probe.read(&parts.cells) } else { output.safe };
            }
            let (names, recorder) = (&part.names, &mut parts.recorder);
            part.direct.write(&part.values, &mut |e: IoEvent| {
                told = true;
                recorder.push(names.entry(now, &e));
            });
        }
        if told && live {
            // A chip that was found gone takes its inputs along: their quality is shown with the next execution.
            interrupt.arrivals.tick(now);
        }
    }
}
