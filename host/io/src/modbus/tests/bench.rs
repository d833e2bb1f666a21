//! A driver on the bench: its points, its events, the demands on it.

use super::super::keys::Timing;
use super::super::session::Session;
use super::device::Device;
use crate::driver::{Driver, DriverConfig, DriverContext, Outputs, PointConfig};
use latchwork_image::{Location, Quality, RegionReader, RegionWriter, Resolved, View, region};
use latchwork_schema::{Value, Values};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio::time::{Instant, sleep};

/// Keys of a point or driver: `a = 1, b = "text"`, durations as `"5ms"`.
pub(super) fn values(keys: &[(&str, Value)]) -> Values {
    let entries = keys.iter().map(|(k, v)| ((*k).to_owned(), (v.clone(), 0..0))).collect();
    Values { span: 0..0, entries }
}

pub(super) fn text(t: &str) -> Value {
    Value::Text(t.into())
}

/// A point; `safe` makes it an output.
pub(super) fn point(name: &str, keys: &[(&str, Value)], safe: Option<u64>) -> PointConfig {
    let values = values(keys);
    let ty = super::super::point::point(&values).map_or(latchwork_image::Type::Bool, |shape| shape.ty);
    PointConfig { name: name.into(), values, ty, safe }
}

pub(super) fn config(points: Vec<PointConfig>) -> DriverConfig {
    DriverConfig { name: "field".into(), values: Values::default(), points }
}

/// Every 50 ms, 100 ms timeout, everything written once a second, pauses of 250 ms to 2 s.
pub(super) const TIMING: Timing = Timing {
    every: Duration::from_millis(50),
    timeout: Duration::from_millis(100),
    refresh: Duration::from_millis(1000),
    reconnect_min: Duration::from_millis(250),
    reconnect_max: Duration::from_millis(2000),
};

pub(super) struct Bench {
    pub(super) inputs: RegionReader,
    demands: RegionWriter,
    cells: Vec<u64>,
    events: Arc<Mutex<Vec<String>>>,
    stop: watch::Sender<bool>,
    pub(super) task: JoinHandle<()>,
}

impl Bench {
    /// Starts a driver for `device`; its output points show 0 and their lane runs.
    pub(super) fn start(device: &Device, points: Vec<PointConfig>) -> Self {
        let outputs = points.iter().filter(|p| p.safe.is_some()).count();
        let read = points.len() - outputs;
        let (writer, inputs) = region(&[0, Quality::Bad.cell()].repeat(read));
        let cells = [vec![0; outputs], vec![Outputs::RUNNING]].concat();
        let (demands, reader) = region(&cells);
        let at = |slot| Resolved::Cell {
            location: Location { region: 0, slot: slot as u32, bit: None, quality: None },
            not: false,
        };
        let tags: Vec<Resolved> = (0..outputs).flat_map(|n| [at(n), at(outputs)]).collect();
        let (stop, stopped) = watch::channel(false);
        let events = Arc::new(Mutex::new(Vec::new()));
        let (kept, begin) = (Arc::clone(&events), Instant::now());
        let context = DriverContext {
            inputs: writer,
            outputs: Outputs::new(View::new(&[reader], &tags)),
            clock: Arc::new(move || begin.elapsed().as_nanos() as u64),
            report: Box::new(move |e| {
                let line = format!(
                    "{}ms {} {} ({}): {}",
                    begin.elapsed().as_millis(),
                    e.source,
                    e.transition,
                    e.priority,
                    e.text
                );
                kept.lock().unwrap().push(line);
            }),
            stop: stopped,
        };
        let session = Session::new(&config(points), TIMING, device.clone()).unwrap();
        let task = tokio::spawn(Box::new(session).run(context));
        Self { inputs, demands, cells, events, stop, task }
    }

    /// Value and quality of input point `n`.
    pub(super) fn input(&self, n: u32) -> (u64, Quality) {
        (self.inputs.cell(2 * n), Quality::from_cell(self.inputs.cell(2 * n + 1)))
    }

    /// What output `n` is to show.
    pub(super) fn demand(&mut self, n: usize, cell: u64) {
        self.cells[n] = cell;
        self.demands.publish(&self.cells, 0);
    }

    /// The lane behind the outputs runs, or not.
    pub(super) fn lane(&mut self, runs: bool) {
        *self.cells.last_mut().unwrap() = u64::from(runs);
        self.demands.publish(&self.cells, 0);
    }

    pub(super) fn take_events(&self) -> Vec<String> {
        std::mem::take(&mut self.events.lock().unwrap())
    }

    /// Stops the driver and tells how long it took, ms.
    pub(super) async fn stop(&mut self) -> u64 {
        let begin = Instant::now();
        self.stop.send_replace(true);
        (&mut self.task).await.unwrap();
        begin.elapsed().as_millis() as u64
    }
}

/// Lets virtual time pass.
pub(super) async fn pass(ms: u64) {
    sleep(Duration::from_millis(ms)).await;
}
