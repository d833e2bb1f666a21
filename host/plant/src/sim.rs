//! Points of `sim` drivers: regions that a stimulus writes.

use crate::lane::{Sender, Simulated};
use crate::model::Model;
use crate::operate::Operation;
use latchwork_image::{Quality, RegionWriter, Type};
use latchwork_io::driver::PointConfig;
use std::collections::HashMap;

/// A stimulus row, resolved.
#[derive(Clone, Debug)]
pub struct Stimulus {
    /// Plant time, ns.
    pub time: u64,
    /// What it does.
    pub action: Action,
}

/// What a stimulus row does.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Sets an input point.
    Point {
        /// Place among the sim points.
        place: PointPlace,
        /// Value.
        cell: u64,
    },
    /// Sets an input point as a device that works more or less well would: what `run --stimulus` has no words for.
    Signal {
        /// Place among the sim points.
        place: PointPlace,
        /// Value; `None`: as it is.
        cell: Option<u64>,
        /// Quality.
        quality: Quality,
    },
    /// Sends a command to a block: `true` is one shot, `false` takes it back.
    Command {
        /// Block of the model.
        block: usize,
        /// Bit.
        bit: u8,
        /// Set or cleared.
        set: bool,
    },
    /// What an operator would do.
    Operate(Operation),
}

/// Where a sim point stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointPlace {
    /// In the region of its driver.
    Region {
        /// Driver.
        driver: usize,
        /// Cell.
        slot: usize,
    },
    /// With an interrupt lane that it starts.
    Edge {
        /// Lane, as [`SimPoints`] counts them.
        lane: usize,
        /// Place among the lane's sim points.
        at: usize,
    },
}

struct SimLane {
    edges: Vec<Simulated>,
    to: Sender,
}

/// First value of a sim point.
pub(crate) fn initial(point: &PointConfig) -> u64 {
    let constant = point.values.constant("initial");
    constant.and_then(|c| latchwork_schema::cell(&point.ty, c).ok()).unwrap_or(0)
}

struct SimDriver {
    region: RegionWriter,
    cells: Vec<u64>,
    changed: bool,
}

/// All points of `sim` drivers.
#[derive(Default)]
pub struct SimPoints {
    drivers: Vec<SimDriver>,
    lanes: Vec<SimLane>,
    points: HashMap<String, (PointPlace, Type)>,
    fed: Vec<String>,
}

impl SimPoints {
    pub(crate) fn add(&mut self, model: &Model, index: usize, region: RegionWriter) {
        let driver = &model.drivers[index];
        let mut cells = Vec::new();
        for (point, source) in driver.config.points.iter().zip(&driver.sources) {
            let name = format!("{}.{}", driver.config.name, point.name);
            if point.safe.is_none() && source.is_some() {
                self.fed.push(name);
            }
        }
        for point in model.region_inputs(index) {
            let point = &driver.config.points[point];
            let place = PointPlace::Region { driver: self.drivers.len(), slot: cells.len() };
            self.points.insert(format!("{}.{}", driver.config.name, point.name), (place, point.ty.clone()));
            cells.extend([initial(point), Quality::Good.cell()]);
        }
        self.drivers.push(SimDriver { region, cells, changed: true });
        self.publish(0);
    }

    /// Points that start an interrupt lane, by name.
    pub(crate) fn add_edges(&mut self, edges: Vec<(String, Simulated)>, to: Sender) {
        let (lane, mut list) = (self.lanes.len(), Vec::new());
        for (at, (name, edge)) in edges.into_iter().enumerate() {
            self.points.insert(name, (PointPlace::Edge { lane, at }, Type::Bool));
            list.push(edge);
        }
        self.lanes.push(SimLane { edges: list, to });
    }

    /// The place and type of an input point.
    pub fn find(&self, tag: &str) -> Option<(PointPlace, &Type)> {
        self.points.get(tag).map(|(place, ty)| (*place, ty))
    }

    /// True for a point that a model feeds: a stimulus would have no effect.
    pub fn is_fed(&self, tag: &str) -> bool {
        self.fed.iter().any(|f| f == tag)
    }

    /// Names of all input points.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.points.keys().map(String::as_str)
    }

    /// Sets a point at plant time `now`; visible after the next [`Self::publish`], or at once to the interrupt lane that it
    /// starts.
    pub fn set(&mut self, place: PointPlace, cell: u64, now: u64) {
        match place {
            PointPlace::Region { driver, slot } => {
                let driver = &mut self.drivers[driver];
                driver.cells[slot] = cell;
                driver.changed = true;
            }
            PointPlace::Edge { lane, at } => self.lanes[lane].set(at, cell & 1 == 1, now),
        }
    }

    /// Sets the quality of a point, and its value if one is given, at plant time `now`; visible as after [`Self::set`].
    pub fn signal(&mut self, place: PointPlace, cell: Option<u64>, quality: Quality, now: u64) {
        match place {
            PointPlace::Region { driver, slot } => {
                let driver = &mut self.drivers[driver];
                driver.cells[slot] = cell.unwrap_or(driver.cells[slot]);
                driver.cells[slot + 1] = quality.cell();
                driver.changed = true;
            }
            PointPlace::Edge { lane, at } => self.lanes[lane].signal(at, cell.map(|c| c & 1 == 1), quality, now),
        }
    }

    /// Publishes what changed, at plant time `now`.
    pub fn publish(&mut self, now: u64) {
        for driver in &mut self.drivers {
            if std::mem::take(&mut driver.changed) | driver.region.forces_changed() {
                driver.region.publish(&driver.cells, now);
            }
        }
    }
}

impl SimLane {
    fn set(&mut self, at: usize, level: bool, now: u64) {
        if self.edges[at].set(level, now, &mut self.to) {
            self.to.wake();
        }
    }

    /// As a line that fails or comes back: the lane executes for that, too, and once if there is an edge with it.
    fn signal(&mut self, at: usize, level: Option<bool>, quality: Quality, now: u64) {
        let changed = self.edges[at].qualify(quality);
        let edge = level.is_some_and(|level| self.edges[at].set(level, now, &mut self.to));
        if edge || (changed && self.to.tick(now)) {
            self.to.wake();
        }
    }
}
