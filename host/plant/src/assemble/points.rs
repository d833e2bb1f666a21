//! Drivers: what the I/O thread serves of them, and what interrupt lanes do.

use super::Sources;
use crate::lane::{DirectInput, DirectNames, DirectOutput, DirectPart, EdgeKind};
use crate::layout::{Layout, Probe, STATE};
use crate::model::{Driver, Lane, Model, Served, TagRef};
use latchwork_image::{Location, RegionReader, Resolved, View};
use latchwork_io::direct::Role;
use latchwork_io::driver::{DriverConfig, Outputs};
use latchwork_record::SourceId;
use std::collections::HashMap;

/// A driver's name and those of its points as sources of records.
pub(super) struct DriverSources {
    pub(super) source: SourceId,
    pub(super) known: HashMap<String, SourceId>,
}

impl DriverSources {
    pub(super) fn new(driver: &Driver, sources: &mut Sources) -> Self {
        let name = &driver.config.name;
        let source = sources.add(name.clone());
        let mut known = HashMap::from([(name.clone(), source)]);
        for point in &driver.config.points {
            let full = format!("{name}.{}", point.name);
            known.insert(full.clone(), sources.add(full));
        }
        Self { source, known }
    }

    /// A point as a source.
    pub(super) fn point(&self, driver: &Driver, point: usize) -> SourceId {
        let full = format!("{}.{}", driver.config.name, driver.config.points[point].name);
        self.known.get(&full).copied().unwrap_or(self.source)
    }
}

/// The part of a driver's configuration that the I/O thread serves; `None` when nothing is left for it.
pub(super) fn for_io_thread(model: &Model, driver: usize) -> Option<DriverConfig> {
    let mut config = model.drivers[driver].config.clone();
    let all = config.points.len();
    let mut at = 0..all;
    config.points.retain(|_| at.next().is_some_and(|point| model.server(driver, point).is_none()));
    // A driver without points still connects; one whose points are all elsewhere has nothing to do.
    (all == 0 || !config.points.is_empty()).then_some(config)
}

/// The points of real drivers that an interrupt lane serves, by driver.
pub(super) fn direct_parts(
    model: &Model,
    layout: &Layout,
    lane: usize,
    sources: &[DriverSources],
) -> Result<Vec<DirectPart>, (String, String)> {
    let mut parts = Vec::new();
    let of: &Lane = &model.lanes[lane];
    for (index, driver) in model.drivers.iter().enumerate() {
        let Some(build) = driver.kind.direct.filter(|_| !driver.simulated(model.sim)) else { continue };
        let served: Vec<(usize, &Served)> = of.served.iter().enumerate().filter(|(_, s)| s.driver == index).collect();
        if served.is_empty() {
            continue;
        }
        let points = served.iter().map(|(_, s)| driver.config.points[s.point].clone()).collect();
        let config = DriverConfig { points, ..driver.config.clone() };
        let roles = served.iter().map(|(_, s)| s.role).collect();
        let failed = |message| (driver.config.name.clone(), message);
        let direct = build(config, roles).map_err(failed)?;
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for (point, (at, s)) in served.iter().enumerate() {
            let config = &driver.config.points[s.point];
            if let Some(cell) = layout.lanes[lane].served[*at] {
                let edge = (s.role == Role::Edge).then_some(*at as u32);
                let level = s.role == Role::Level || EdgeKind::of(config) != EdgeKind::Both;
                inputs.push(DirectInput { point, cell, edge, level, good: false });
                continue;
            }
            let tag = layout.ids[&TagRef::Point { driver: index, point: s.point }];
            let resolved = layout.tags.resolve(tag).map_err(|e| failed(e.to_string()))?;
            let probe = match resolved {
                Resolved::Cell { location: Location { slot, bit, .. }, not } => Probe { cell: slot, shift: bit, not },
                Resolved::Constant(_) => return Err(failed(format!("point `{}` shows a constant", config.name))),
            };
            outputs.push(DirectOutput { point, probe, safe: config.safe.unwrap_or(0), good: false });
        }
        let values = vec![0; outputs.len()];
        let names = DirectNames { driver: sources[index].source, points: sources[index].known.clone() };
        parts.push(DirectPart { direct, inputs, outputs, values, names });
    }
    Ok(parts)
}

/// Two entries per output point that the I/O thread serves: its value, and the state of the lane it comes from.
pub(super) fn outputs(
    model: &Model,
    layout: &Layout,
    regions: &[RegionReader],
    driver: usize,
) -> Result<Outputs, latchwork_image::TagError> {
    let mut wanted = Vec::new();
    for (point, config) in model.drivers[driver].config.points.iter().enumerate() {
        if config.safe.is_none() || model.server(driver, point).is_some() {
            continue;
        }
        let value = layout.tags.resolve(layout.ids[&TagRef::Point { driver, point }])?;
        wanted.push(value);
        wanted.push(match value {
            Resolved::Cell { location, .. } if (location.region as usize) < model.lanes.len() => Resolved::Cell {
                location: Location { region: location.region, slot: STATE, bit: None, quality: None },
                not: false,
            },
            // A point that repeats another driver's input or a setting follows no lane.
            _ => Resolved::Constant(Outputs::RUNNING),
        });
    }
    Ok(Outputs::new(View::new(regions, &wanted)))
}
