//! The part on the I/O thread: points that belong to no interrupt lane.

use super::points::Points;
use crate::cycle::{Cycle, Lines};
use crate::direct::{Direct, Report, Role};
use crate::driver::{Demand, DriverConfig};
use std::time::Duration;

/// A driver that has not begun, for a checked configuration.
pub(super) fn session(config: &DriverConfig, every: Duration) -> Result<Cycle<Points>, String> {
    let role = |safe: Option<u64>| if safe.is_some() { Role::Output } else { Role::Level };
    let roles: Vec<Role> = config.points.iter().map(|p| role(p.safe)).collect();
    Ok(Cycle::new(Points::new(config, &roles)?, every))
}

impl Lines for Points {
    fn inputs(&self) -> usize {
        self.inputs.len()
    }

    fn open(&mut self, seconds: u32, report: Report<'_>) {
        self.try_open(seconds, report);
    }

    fn check(&mut self, _: Report<'_>) {
        // Registers do not go away, and lines of the kernel are inputs, which are read.
    }

    fn read(&mut self, take: &mut dyn FnMut(usize, bool), report: Report<'_>) {
        for place in 0..self.inputs.len() {
            if let Some(level) = self.level(self.inputs[place], report) {
                take(place, level);
            }
        }
    }

    fn cell(&mut self, n: usize, demand: Demand) -> u64 {
        match demand {
            Demand::Live(cell) => cell,
            Demand::First | Demand::Safe => self.safe(n),
        }
    }

    fn write(&mut self, cells: &[u64], report: Report<'_>) {
        Direct::write(self, cells, report);
    }

    fn make_safe(&mut self, report: Report<'_>) {
        Self::make_safe(self, report);
    }
}
