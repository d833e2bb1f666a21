//! The part on the I/O thread: points that belong to no interrupt lane.

use super::keys::every;
use super::port::Port;
use super::settings::Use;
use crate::driver::{Demand, Driver, DriverConfig, DriverContext, Outputs};
use latchwork_image::{Quality, RegionWriter};
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{Instant, MissedTickBehavior, interval};

/// Pause between two tries to open what is closed.
const RETRY: Duration = Duration::from_secs(1);

/// A driver that has not begun.
pub(super) struct Session {
    port: Port,
    every: Duration,
}

impl Session {
    pub(super) fn new(config: &DriverConfig) -> Result<Self, String> {
        let usage = |n: usize| if config.points[n].safe.is_some() { Use::Output } else { Use::Level };
        Ok(Self { port: Port::new(config, usage)?, every: every(&config.values) })
    }
}

impl Driver for Session {
    fn run(self: Box<Self>, context: DriverContext) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(async move {
            let DriverContext { inputs, outputs, clock, report, stop } = context;
            let mut report = report;
            // In this order: dropped in the reverse one, the outputs are safe before the inputs turn bad.
            let mut inputs = Inputs::new(&self.port, inputs, clock);
            let (mut port, mut outputs) = (self.port, Demands::new(outputs));
            let mut timer = interval(self.every);
            timer.set_missed_tick_behavior(MissedTickBehavior::Skip);
            let (mut stop, mut next) = (stop, Instant::now());
            loop {
                tokio::select! {
                    biased;
                    _ = stop.wait_for(|s| *s) => break,
                    _ = timer.tick() => {}
                }
                if !port.is_open() && Instant::now() >= next {
                    port.open(&mut *report);
                    next = Instant::now() + RETRY;
                }
                inputs.read(&mut port, &mut *report);
                outputs.write(&mut port, &mut *report);
            }
            port.make_safe(&mut *report);
        })
    }
}

/// The input points' cells. When it goes, however that happens, they turn bad: nobody reads the lines any more.
struct Inputs {
    region: RegionWriter,
    clock: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// Place of each point among the inputs.
    places: Vec<usize>,
    /// Value and quality of each input, as published.
    cells: Vec<u64>,
    /// The same, as read.
    fresh: Vec<u64>,
    /// The first reading is published even if it is as bad as before: who waits for it must see that it was tried.
    first: bool,
}

impl Inputs {
    fn new(port: &Port, region: RegionWriter, clock: Arc<dyn Fn() -> u64 + Send + Sync>) -> Self {
        let mut inputs = 0;
        let places = port.lines.iter().map(|l| {
            inputs += usize::from(l.usage == Use::Level);
            inputs.saturating_sub(1)
        });
        let places = places.collect();
        let cells = [0, Quality::Bad.cell()].repeat(inputs);
        let mut new = Self { region, clock, places, fresh: cells.clone(), cells, first: true };
        new.publish();
        new
    }

    /// Reads all inputs; what is closed keeps its last value and is bad.
    fn read(&mut self, port: &mut Port, report: &mut dyn FnMut(crate::driver::IoEvent)) {
        self.distrust();
        let (places, fresh) = (&self.places, &mut self.fresh);
        let take = |point: usize, level: bool| {
            fresh[2 * places[point]] = u64::from(level);
            fresh[2 * places[point] + 1] = Quality::Good.cell();
        };
        port.levels(take, report);
        if self.first || self.fresh != self.cells {
            self.first = false;
            self.publish();
        }
    }

    fn distrust(&mut self) {
        self.fresh.chunks_exact_mut(2).for_each(|c| c[1] = Quality::Bad.cell());
    }

    fn publish(&mut self) {
        self.cells.copy_from_slice(&self.fresh);
        self.region.publish(&self.cells, (self.clock)());
    }
}

impl Drop for Inputs {
    fn drop(&mut self) {
        self.distrust();
        self.publish();
    }
}

/// What the outputs are to show.
struct Demands {
    outputs: Outputs,
    /// One per output point.
    wanted: Vec<u64>,
}

impl Demands {
    fn new(outputs: Outputs) -> Self {
        Self { wanted: vec![0; outputs.len()], outputs }
    }

    fn write(&mut self, port: &mut Port, report: &mut dyn FnMut(crate::driver::IoEvent)) {
        self.outputs.refresh();
        let safe = port.lines.iter().filter(|l| l.usage == Use::Output).map(|l| u64::from(l.safe));
        for ((n, cell), safe) in self.wanted.iter_mut().enumerate().zip(safe) {
            *cell = match self.outputs.demand(n) {
                Demand::Live(cell) => cell,
                Demand::Safe => safe,
            };
        }
        port.write(&self.wanted, report);
    }
}
