//! Interrupt lanes: their inputs, and who tells them what.

use super::points::{DriverSources, direct_parts};
use super::{AssembleError, Time};
use crate::lane::{Arrivals, EdgeInput, EdgeKind, Feed, Follower, Interrupt, Sender, Simulated, Wake, Watched};
use crate::layout::{Layout, Probe};
use crate::model::{self, Model, TagRef};
use crate::sim::SimPoints;
use latchwork_image::{Location, Quality, Resolved};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};

/// Events one source may have under way to one lane.
const EVENTS: usize = 4096;

/// What the lanes need besides their blocks, by lane.
pub(super) struct Interrupts {
    interrupts: Vec<Option<Box<Interrupt>>>,
    pub(super) followers: Vec<Vec<Follower>>,
    pub(super) initial: Vec<Vec<(u32, u64)>>,
    pub(super) wakes: Vec<Arc<Wake>>,
}

/// Where a polling lane sees value and quality of each input of its `on`; empty for any other lane.
pub(super) type Polled = Vec<(Probe, Probe)>;

/// Makes the inputs of `on` visible in lanes that poll; by lane.
pub(super) fn polled(model: &Model, layout: &mut Layout) -> Result<Vec<Polled>, AssembleError> {
    let mut lanes = Vec::new();
    for (index, lane) in model.lanes.iter().enumerate() {
        let mut probes = Polled::new();
        for (driver, point) in lane.interrupt.iter().filter(|i| i.poll).flat_map(|i| &i.on) {
            let tag = layout.ids[&TagRef::Point { driver: *driver, point: *point }];
            let (value, quality) = (layout.probe(index, tag)?, layout.probe_quality(index, tag)?);
            probes.push(value.zip(quality).ok_or_else(|| AssembleError::Lane {
                lane: lane.name.clone(),
                message: format!("`{}` never changes", layout.tags.get(tag).name),
            })?);
        }
        lanes.push(probes);
    }
    Ok(lanes)
}

/// What interrupt lanes are assembled from.
pub(super) struct Context<'a> {
    pub(super) model: &'a Model,
    pub(super) layout: &'a Layout,
    /// The lanes' marks.
    pub(super) oldest: &'a [Arc<AtomicU64>],
    pub(super) sources: &'a [DriverSources],
    pub(super) time: Time,
}

impl Interrupts {
    pub(super) fn new(context: &Context<'_>, polled: Vec<Polled>, sim: &mut SimPoints) -> Result<Self, AssembleError> {
        let lanes = context.model.lanes.len();
        let mut all = Self {
            interrupts: (0..lanes).map(|_| None).collect(),
            followers: (0..lanes).map(|_| Vec::new()).collect(),
            initial: (0..lanes).map(|_| Vec::new()).collect(),
            wakes: Vec::new(),
        };
        for ((index, lane), polled) in context.model.lanes.iter().enumerate().zip(polled) {
            if let Some(interrupt) = &lane.interrupt {
                all.add(context, index, interrupt, polled, sim)?;
            }
        }
        Ok(all)
    }

    pub(super) fn take(&mut self, lane: usize) -> Option<Box<Interrupt>> {
        self.interrupts[lane].take()
    }

    fn add(
        &mut self,
        context: &Context<'_>,
        lane: usize,
        of: &model::Interrupt,
        polled: Polled,
        sim: &mut SimPoints,
    ) -> Result<(), AssembleError> {
        let Context { model, layout, oldest, sources, time } = *context;
        let failed = |message| AssembleError::Lane { lane: model.lanes[lane].name.clone(), message };
        let wake = match time {
            Time::Real => Some(Arc::new(Wake::new().map_err(|e| failed(format!("no eventfd: {e}")))?)),
            Time::Virtual => None,
        };
        self.wakes.extend(wake.clone());
        let source = |(driver, point): &(usize, usize)| sources[*driver].point(&model.drivers[*driver], *point);
        let names: Vec<_> = of.on.iter().map(source).collect();
        let (mut events, mut edges, mut watched) = (Vec::new(), Vec::new(), Vec::new());
        let mut sender = || {
            let (producer, consumer) = rtrb::RingBuffer::new(EVENTS);
            events.push(consumer);
            Sender { events: producer, wake: wake.clone(), oldest: Arc::clone(&oldest[lane]) }
        };
        let mut feeds: Vec<(usize, Feed)> = Vec::new();
        if of.poll {
            for ((on, source), (probe, quality)) in of.on.iter().zip(&names).zip(polled) {
                let ty = layout.tags.get(layout.ids[&TagRef::Point { driver: on.0, point: on.1 }]).ty.clone();
                watched.push(Watched { probe, quality, ty, source: *source, last: None });
            }
        } else {
            let mut simulated = Vec::new();
            for (number, (driver, point)) in of.on.iter().enumerate() {
                let (d, config) = (&model.drivers[*driver], &model.drivers[*driver].config.points[*point]);
                let Some(cell) = layout.lanes[lane].served[number] else { continue };
                let (input, kind) = (number as u32, EdgeKind::of(config));
                let (mut level, mut now, mut quality) = (false, None, None);
                if d.simulated(model.sim) {
                    level = crate::sim::initial(config) & 1 == 1;
                    self.initial[lane].push((cell + 1, Quality::Good.cell()));
                    let point_quality = Arc::new(AtomicU64::new(Quality::Good.cell()));
                    quality = Some(Arc::clone(&point_quality));
                    let point_level = Arc::new(AtomicBool::new(level));
                    now = (kind != EdgeKind::Both).then(|| Arc::clone(&point_level));
                    let to = Simulated { input, edge: kind, level: point_level, quality: point_quality, missed: 0 };
                    if let Some(wire) = &d.sources[*point] {
                        let (from, probe) = feeding(layout, wire).ok_or_else(|| {
                            failed(format!("`{}.{}` is fed by what no block makes", d.config.name, config.name))
                        })?;
                        feeds.push((from, Feed { probe, to }));
                    } else {
                        simulated.push((format!("{}.{}", d.config.name, config.name), to));
                    }
                }
                self.initial[lane].push((cell, u64::from(level)));
                edges.push(EdgeInput { cell, level, now, quality });
            }
            if !simulated.is_empty() {
                sim.add_edges(simulated, sender());
            }
        }
        for from in 0..model.lanes.len() {
            let (mine, others): (Vec<_>, Vec<_>) = feeds.into_iter().partition(|(l, _)| *l == from);
            feeds = others;
            let ticks = of.also_with == Some(from);
            if ticks || !mine.is_empty() {
                let feeds = mine.into_iter().map(|(_, f)| f).collect();
                self.followers[from].push(Follower { ticks, feeds, to: sender() });
            }
        }
        let points = direct_parts(model, layout, lane, sources)
            .map_err(|(driver, message)| AssembleError::Driver { driver, message })?;
        let served: Vec<_> = layout.lanes[lane].served.iter().flatten().copied().collect();
        let served = served.iter().min().map_or(0..0, |first| *first..served.iter().max().unwrap_or(first) + 2);
        let arrivals = Arrivals::new(&names, of.queue, of.storm_limit);
        let interrupt = Interrupt { arrivals, edges, watched, points, events, wake, served };
        self.interrupts[lane] = Some(Box::new(interrupt));
        Ok(())
    }
}

/// The lane whose block makes a tag, and where it sees it.
fn feeding(layout: &Layout, wire: &model::Wire) -> Option<(usize, Probe)> {
    match layout.tags.resolve(layout.ids[&wire.tag]).ok()? {
        Resolved::Cell { location: Location { region, slot, bit, .. }, not }
            if (region as usize) < layout.lanes.len() =>
        {
            Some((region as usize, Probe { cell: slot, shift: bit, not: not ^ wire.not }))
        }
        _ => None,
    }
}
