//! The cycle on the I/O thread, for the points that no interrupt lane serves.

use super::points::Points;
use crate::direct::{Direct, Role};
use crate::driver::{Demand, Driver, DriverConfig, DriverContext, Outputs};
use latchwork_image::{Quality, RegionWriter};
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{Instant, MissedTickBehavior, interval};

/// Pause between tries to open what is closed.
const RETRY: Duration = Duration::from_secs(1);

/// A driver that has not begun.
pub(super) struct Session {
    points: Points,
    every: Duration,
    /// Points that are inputs, in their order.
    inputs: Vec<usize>,
}

impl Session {
    /// A session for a checked configuration.
    pub(super) fn new(config: DriverConfig, every: Duration) -> Result<Self, String> {
        let role = |safe: Option<u64>| if safe.is_some() { Role::Output } else { Role::Level };
        let roles: Vec<Role> = config.points.iter().map(|p| role(p.safe)).collect();
        let inputs = (0..roles.len()).filter(|n| roles[*n] == Role::Level).collect();
        Ok(Self { points: Points::new(&config, &roles)?, every, inputs })
    }
}

impl Driver for Session {
    fn run(self: Box<Self>, context: DriverContext) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(async move {
            let Self { mut points, every, inputs } = *self;
            let DriverContext { inputs: region, mut outputs, clock, mut report, mut stop } = context;
            let mut inputs = Inputs::new(inputs, region, clock);
            let mut cells = vec![0; outputs.len()];
            let mut timer = interval(every);
            // The grid of the schedule stays; what was missed is left out, not made up for.
            timer.set_missed_tick_behavior(MissedTickBehavior::Skip);
            let mut due = Instant::now();
            loop {
                tokio::select! {
                    biased;
                    _ = stop.wait_for(|s| *s) => break,
                    now = timer.tick() => if now >= due && !points.healthy() {
                        due = now + RETRY;
                        points.open(&mut *report);
                    }
                }
                inputs.read(&mut points, &mut *report);
                demanded(&mut outputs, &points, &mut cells);
                points.write(&cells, &mut *report);
            }
            points.make_safe(&mut *report);
        })
    }
}

/// Asks what the outputs are to show.
fn demanded(outputs: &mut Outputs, points: &Points, cells: &mut [u64]) {
    outputs.refresh();
    for (n, cell) in cells.iter_mut().enumerate() {
        *cell = match outputs.demand(n) {
            Demand::Live(cell) => cell,
            Demand::Safe => points.safe(n),
        };
    }
}

/// The input points and their cells. When it goes, however that happens, the points turn bad: nobody reads them on.
struct Inputs {
    points: Vec<usize>,
    region: RegionWriter,
    clock: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// Value and quality of each point.
    cells: Vec<u64>,
}

impl Inputs {
    fn new(points: Vec<usize>, region: RegionWriter, clock: Arc<dyn Fn() -> u64 + Send + Sync>) -> Self {
        let cells = [0, Quality::Bad.cell()].repeat(points.len());
        let mut inputs = Self { points, region, clock, cells };
        inputs.publish();
        inputs
    }

    /// Reads all inputs and publishes them at once; one that cannot be read keeps its value and is bad.
    fn read(&mut self, points: &mut Points, report: crate::direct::Report<'_>) {
        for (point, cells) in self.points.iter().zip(self.cells.chunks_exact_mut(2)) {
            let level = points.level(*point, report);
            cells[0] = level.map_or(cells[0], u64::from);
            cells[1] = if level.is_some() { Quality::Good.cell() } else { Quality::Bad.cell() };
        }
        self.publish();
    }

    fn publish(&mut self) {
        self.region.publish(&self.cells, (self.clock)());
    }
}

impl Drop for Inputs {
    fn drop(&mut self) {
        self.cells.chunks_exact_mut(2).for_each(|c| c[1] = Quality::Bad.cell());
        self.publish();
    }
}
