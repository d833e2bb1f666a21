//! Points of `sim` drivers: regions that a stimulus writes.

use crate::model::Driver;
use latchwork_image::{Quality, RegionWriter, Type};
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
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Sets an input point.
    Point {
        /// Place among the sim points.
        place: PointPlace,
        /// Value.
        cell: u64,
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
}

/// Where a sim point stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointPlace {
    driver: usize,
    slot: usize,
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
    points: HashMap<String, (PointPlace, Type)>,
    fed: Vec<String>,
}

impl SimPoints {
    pub(crate) fn add(&mut self, driver: &Driver, region: RegionWriter) {
        let mut cells = Vec::new();
        for (point, source) in driver.config.points.iter().zip(&driver.sources) {
            if point.safe.is_some() {
                continue;
            }
            let name = format!("{}.{}", driver.config.name, point.name);
            if source.is_some() {
                self.fed.push(name.clone());
            }
            let place = PointPlace { driver: self.drivers.len(), slot: cells.len() };
            self.points.insert(name, (place, point.ty.clone()));
            let initial =
                point.values.constant("initial").and_then(|c| latchwork_io::sim::cell(&point.ty, c).ok()).unwrap_or(0);
            cells.extend([initial, Quality::Good.cell()]);
        }
        self.drivers.push(SimDriver { region, cells, changed: true });
        self.publish(0);
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

    /// Sets a point; visible after the next [`Self::publish`].
    pub fn set(&mut self, place: PointPlace, cell: u64) {
        let driver = &mut self.drivers[place.driver];
        driver.cells[place.slot] = cell;
        driver.changed = true;
    }

    /// Publishes what changed, at plant time `now`.
    pub fn publish(&mut self, now: u64) {
        for driver in &mut self.drivers {
            if std::mem::take(&mut driver.changed) {
                driver.region.publish(&driver.cells, now);
            }
        }
    }
}
