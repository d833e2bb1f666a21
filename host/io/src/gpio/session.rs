//! The part on the I/O thread: points that belong to no interrupt lane.

use super::keys::every;
use super::port::Port;
use super::settings::Use;
use crate::cycle::{Cycle, Lines};
use crate::direct::Report;
use crate::driver::{Demand, DriverConfig};

/// A driver that has not begun.
pub(super) fn session(config: &DriverConfig) -> Result<Cycle<Port>, String> {
    let usage = |n: usize| if config.points[n].safe.is_some() { Use::Output } else { Use::Level };
    Ok(Cycle::new(Port::new(config, usage)?, every(&config.values)))
}

impl Lines for Port {
    fn inputs(&self) -> usize {
        self.lines.iter().filter(|l| l.usage == Use::Level).count()
    }

    fn open(&mut self, seconds: u32, report: Report<'_>) {
        Self::open(self, seconds, report);
    }

    fn check(&mut self, report: Report<'_>) {
        Self::check(self, report);
    }

    fn read(&mut self, take: &mut dyn FnMut(usize, bool), report: Report<'_>) {
        self.levels(take, report);
    }

    fn cell(&mut self, n: usize, demand: Demand) -> u64 {
        let Some(line) = self.outputs.get(n).and_then(|point| self.lines.get_mut(*point)) else { return 0 };
        line.begun |= demand != Demand::First;
        match demand {
            Demand::Live(cell) => cell,
            Demand::First => line.first().into(),
            Demand::Safe => line.safe.into(),
        }
    }

    fn write(&mut self, cells: &[u64], report: Report<'_>) {
        Self::write(self, cells, report);
    }

    fn make_safe(&mut self, report: Report<'_>) {
        Self::make_safe(self, report);
    }
}
