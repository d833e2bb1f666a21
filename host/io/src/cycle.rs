//! The cycle of a driver whose points are lines: every so often all inputs are read, then all outputs are written.

use crate::direct::Report;
use crate::driver::{Demand, Driver, DriverContext, Outputs};
use latchwork_image::{Quality, RegionWriter};
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{Instant, MissedTickBehavior, interval};

/// How often it is looked whether all is still there, and what is closed is tried again (see [`crate::backoff`]).
const LOOK: Duration = Duration::from_secs(1);

/// The lines of a driver. Dropped, its outputs show their safe values.
pub(crate) trait Lines: Send + 'static {
    /// Number of inputs.
    fn inputs(&self) -> usize;

    /// Tries to open what is closed, if it is time for that: so many seconds have passed since the last call.
    fn open(&mut self, seconds: u32, report: Report<'_>);

    /// Closes what is gone without having been read or written.
    fn check(&mut self, report: Report<'_>);

    /// Reads all inputs and hands on the levels of those that are good, by their place among the inputs.
    fn read(&mut self, take: &mut dyn FnMut(usize, bool), report: Report<'_>);

    /// What output `n`, counted over the outputs alone, shows for a demand.
    fn cell(&mut self, n: usize, demand: Demand) -> u64;

    /// Writes the outputs that differ from what they show.
    fn write(&mut self, cells: &[u64], report: Report<'_>);

    /// Writes all safe values, and tells which did not arrive.
    fn make_safe(&mut self, report: Report<'_>);
}

/// A driver that has not begun.
pub(crate) struct Cycle<L> {
    lines: L,
    every: Duration,
}

impl<L: Lines> Cycle<L> {
    pub(crate) fn new(lines: L, every: Duration) -> Self {
        Self { lines, every }
    }
}

impl<L: Lines> Driver for Cycle<L> {
    fn blocks(&self) -> bool {
        // A line behind I²C or USB takes milliseconds, and one whose adapter hangs as long as the kernel waits for it.
        true
    }

    fn run(self: Box<Self>, context: DriverContext) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(async move {
            let DriverContext { inputs, mut outputs, clock, mut report, mut stop } = context;
            // In this order: dropped in the reverse one, the outputs are safe before the inputs turn bad.
            let mut inputs = Inputs::new(self.lines.inputs(), inputs, clock);
            let mut lines = self.lines;
            let mut cells = vec![0; outputs.len()];
            let mut timer = interval(self.every);
            // The grid of the schedule stays; what was missed is left out, not made up for.
            timer.set_missed_tick_behavior(MissedTickBehavior::Skip);
            let mut looked: Option<Instant> = None;
            loop {
                tokio::select! {
                    biased;
                    _ = stop.wait_for(|s| *s) => break,
                    _ = timer.tick() => {}
                }
                let now = Instant::now();
                let passed = looked.map_or(LOOK, |at| now - at);
                if passed >= LOOK {
                    looked = Some(now);
                    lines.check(&mut *report);
                    lines.open(u32::try_from(passed.as_secs()).unwrap_or(u32::MAX), &mut *report);
                }
                inputs.read(&mut lines, &mut *report);
                write(&mut lines, &mut outputs, &mut cells, &mut *report);
            }
            lines.make_safe(&mut *report);
        })
    }
}

fn write(lines: &mut impl Lines, outputs: &mut Outputs, cells: &mut [u64], report: Report<'_>) {
    outputs.refresh();
    for (n, cell) in cells.iter_mut().enumerate() {
        *cell = lines.cell(n, outputs.demand(n));
    }
    lines.write(cells, report);
}

/// The inputs' cells. When it goes, however that happens, they turn bad: nobody reads the lines any more.
struct Inputs {
    region: RegionWriter,
    clock: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// Value and quality of each input, as published.
    cells: Vec<u64>,
    /// The same, as read.
    fresh: Vec<u64>,
    /// The first reading is published even if it is as bad as before: who waits for it must see that it was tried.
    first: bool,
}

impl Inputs {
    fn new(inputs: usize, region: RegionWriter, clock: Arc<dyn Fn() -> u64 + Send + Sync>) -> Self {
        let cells = [0, Quality::Bad.cell()].repeat(inputs);
        let mut new = Self { region, clock, fresh: cells.clone(), cells, first: true };
        new.publish();
        new
    }

    /// Reads all inputs; what is closed keeps its last value and is bad.
    fn read(&mut self, lines: &mut impl Lines, report: Report<'_>) {
        self.distrust();
        let fresh = &mut self.fresh;
        let mut take = |place: usize, level: bool| {
            if let Some(cells) = fresh.get_mut(2 * place..2 * place + 2) {
                cells.copy_from_slice(&[u64::from(level), Quality::Good.cell()]);
            }
        };
        lines.read(&mut take, report);
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
