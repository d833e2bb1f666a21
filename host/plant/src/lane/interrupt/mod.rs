//! Interrupt lanes: an edge, its time stamp, the lane's own inputs, its blocks, its outputs, then the records.
//!
//! ```text
//! kernel line ──┐                      ┌─ inputs latched ─ blocks in order ─ outputs written ─┐
//! sim point   ──┼─► Arrivals ─ oldest ─┤  (Lane::activate, one at a time)                     ├─► records, region
//! tick, feed  ──┘   (time order)       └──────────────────────────────────────────────────────┘
//! ```
//!
//! A lane with edges gets them from its [`DirectPart`]s, from the stimulus and from feeds, all through [`Arrivals`]. A lane
//! that polls compares its inputs itself. Who runs them, by the clock or at virtual time, is not known here.

mod activate;
mod arrivals;
mod points;
mod storm;

pub use arrivals::{Arrival, Arrivals, Cause, FOLLOW};
pub use points::{DirectInput, DirectNames, DirectOutput, DirectPart};

use super::follow::{Event, Wake};
use super::{Lane, LaneState};
use crate::layout::Probe;
use latchwork_image::Type;
use latchwork_io::direct::Direct;
use latchwork_record::SourceId;
use std::os::fd::BorrowedFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};

/// What makes a lane an interrupt lane.
pub struct Interrupt {
    /// What waits.
    pub arrivals: Arrivals,
    /// The inputs of `on`, in a lane with edges.
    pub edges: Vec<EdgeInput>,
    /// The inputs of `on`, in a lane that polls.
    pub watched: Vec<Watched>,
    /// Points it serves itself, by driver.
    pub points: Vec<DirectPart>,
    /// Events of stimulus and feeds, and of the lane it runs with.
    pub events: Vec<rtrb::Consumer<Event>>,
    /// Wakes its thread; none at virtual time.
    pub wake: Option<Arc<Wake>>,
    /// Cells of the inputs it serves itself: forces hold them, too.
    pub served: std::ops::Range<u32>,
}

/// An input whose edges start the lane.
#[derive(Clone, Debug)]
pub struct EdgeInput {
    /// Cell of its value; that of the quality follows.
    pub cell: u32,
    /// Its level after the last edge, whatever it may be forced to.
    pub level: bool,
    /// Its level now, where the plant simulates it and only one of both edges starts the lane.
    pub now: Option<Arc<AtomicBool>>,
    /// Its quality now as a cell, where the plant simulates it.
    pub quality: Option<Arc<AtomicU64>>,
}

/// An input that a polling lane compares.
pub struct Watched {
    /// Where the lane sees it.
    pub probe: Probe,
    /// Where the lane sees its quality.
    pub quality: Probe,
    /// Type.
    pub ty: Type,
    /// Name as a source of records.
    pub source: SourceId,
    /// Its value and quality at the last reading; none before the first.
    pub last: Option<(u64, u64)>,
}

impl Watched {
    fn read(&self, cells: &[u64]) -> (u64, u64) {
        (self.probe.read(cells), self.quality.read(cells))
    }
}

impl Lane {
    /// True for an interrupt lane.
    pub fn is_interrupt(&self) -> bool {
        self.parts.interrupt.is_some()
    }

    /// True for an interrupt lane that polls.
    pub fn polls(&self) -> bool {
        self.parts.interrupt.as_ref().is_some_and(|i| !i.watched.is_empty())
    }

    /// What waits for the lane.
    pub fn arrivals(&self) -> Option<&Arrivals> {
        self.parts.interrupt.as_ref().map(|i| &i.arrivals)
    }

    /// Puts other lines in place of those it serves: a bench's, or those of a recording.
    pub fn replace_points(&mut self, mut with: impl FnMut(Box<dyn Direct>) -> Box<dyn Direct>) {
        if let Some(interrupt) = &mut self.parts.interrupt {
            let points = std::mem::take(&mut interrupt.points).into_iter();
            interrupt.points = points.map(|part| DirectPart { direct: with(part.direct), ..part }).collect();
        }
    }

    /// Tells the other threads how old the oldest edge that waits is.
    pub fn mark_oldest(&self) {
        self.mark(self.oldest_arrival().unwrap_or(u64::MAX));
    }

    /// Time of the oldest of what waits, ns.
    pub(super) fn oldest_arrival(&self) -> Option<u64> {
        self.arrivals().and_then(Arrivals::oldest)
    }

    /// True while a line is in a storm: lines that nobody waits for.
    pub fn in_storm(&self) -> bool {
        self.arrivals().is_some_and(Arrivals::any_storm)
    }

    /// Begins an interrupt lane at plant time `now`: its first execution needs no edge.
    pub fn begin_interrupts(&mut self, now: u64) {
        if let Some(interrupt) = &mut self.parts.interrupt
            && interrupt.watched.is_empty()
        {
            interrupt.arrivals.tick(now);
        }
    }

    /// Takes what stimulus, feeds and the lane it runs with have sent. A lane that has ended hears of nothing any more.
    pub fn collect(&mut self) {
        let ended = matches!(self.state, LaneState::Stopped | LaneState::Faulted);
        let Some(interrupt) = self.parts.interrupt.as_deref_mut() else { return };
        for events in &mut interrupt.events {
            while let Ok(event) = events.pop() {
                match event {
                    _ if ended => {}
                    Event::Edge { time, input, level, missed } => {
                        interrupt.arrivals.edge(input, time, level, missed, &mut self.parts.recorder);
                    }
                    Event::Tick { time } => interrupt.arrivals.tick(time),
                }
            }
        }
    }

    /// Ends storms and lets through what was held; at plant time `now`.
    pub fn calm(&mut self, now: u64) {
        if let Some(interrupt) = self.parts.interrupt.as_deref_mut() {
            interrupt.arrivals.calm(now, &mut self.parts.recorder);
        }
    }

    /// Tells what nobody will handle any more.
    pub(super) fn settle_arrivals(&mut self, now: u64) {
        if let Some(interrupt) = self.parts.interrupt.as_deref_mut() {
            interrupt.arrivals.settle(now, &mut self.parts.recorder);
        }
    }

    /// The oldest edge or tick that waits, if it is not younger than `until` (plant time, ns).
    pub fn next_arrival(&mut self, until: u64) -> Option<Arrival> {
        let arrivals = &mut self.parts.interrupt.as_mut()?.arrivals;
        if arrivals.peek()? <= until { arrivals.take() } else { None }
    }

    /// Calls `add` with what becomes readable when there is something to do: the wake, and lines that are not in a storm.
    pub fn descriptors<'a>(&'a self, mut add: impl FnMut(BorrowedFd<'a>)) {
        let Some(interrupt) = &self.parts.interrupt else { return };
        if let Some(wake) = &interrupt.wake {
            add(wake.descriptor());
        }
        for part in &interrupt.points {
            part.descriptors(|input| interrupt.arrivals.in_storm(input), &mut add);
        }
    }

    /// Takes the wakes so far: whatever they were for is looked at next.
    pub fn awake(&self) {
        if let Some(wake) = self.parts.interrupt.as_ref().and_then(|i| i.wake.as_ref()) {
            wake.clear();
        }
    }
}
