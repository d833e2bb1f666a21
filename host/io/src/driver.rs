//! The interface between the plant and a driver.

use latchwork_image::{RegionWriter, Type, View};
use latchwork_schema::{Section, Values};
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;

/// A kind of driver: `modbus-tcp`, `sim`, … One static of this type per kind, listed in [`crate::kinds`].
pub struct DriverKind {
    /// Name in the plant file.
    pub name: &'static str,
    /// Keys of `[driver.NAME]` besides `kind` and `points`.
    pub keys: &'static Section,
    /// Keys of one point besides `from` and `safe`.
    pub point_keys: &'static Section,
    /// The type of a point and which ways it can go, or what is wrong with its keys.
    pub point: fn(&Values) -> Result<PointShape, Vec<Problem>>,
    /// What is wrong with the driver's keys and points taken together (two points of one address, …).
    pub check: fn(&DriverConfig) -> Vec<Problem>,
    /// Makes the driver. Nothing is opened before it runs.
    pub build: fn(DriverConfig) -> Result<Box<dyn Driver>, String>,
    /// Makes the part that works in an interrupt lane; `None` for kinds without edges.
    pub direct: Option<crate::direct::Build>,
}

/// What is wrong, and at which key (empty: at the table itself); the plant file's checker adds line and column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Point it is about; `None` for the driver itself.
    pub point: Option<String>,
    /// Key, or empty.
    pub key: String,
    /// What was found and what was expected.
    pub message: String,
    /// The way out.
    pub help: Option<String>,
}

/// What a point can be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PointShape {
    /// Type of its tag.
    pub ty: Type,
    /// It can be written: `from` is allowed.
    pub writable: bool,
    /// It can be read: `from` may be absent.
    pub readable: bool,
}

/// One point of a driver, checked.
#[derive(Clone, Debug)]
pub struct PointConfig {
    /// Name of the point.
    pub name: String,
    /// Its keys.
    pub values: Values,
    /// Type of its tag.
    pub ty: Type,
    /// For an output point the cell that is written at fault and at stop; `None` for an input point.
    pub safe: Option<u64>,
}

/// A driver, checked.
#[derive(Clone, Debug)]
pub struct DriverConfig {
    /// Name of the driver.
    pub name: String,
    /// Its keys.
    pub values: Values,
    /// Its points in the order of the file.
    pub points: Vec<PointConfig>,
}

/// An event a driver reports: a peer that went away, came back, refused.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IoEvent {
    /// What it is about: `DRIVER` or `DRIVER.POINT`; empty for the driver that reports it.
    pub source: String,
    /// The transition in one word: `connected`, `lost`, `refused`, …
    pub transition: &'static str,
    /// How bad, 0 (a note) to 255.
    pub priority: u8,
    /// One sentence for a person.
    pub text: String,
}

/// What a driver works with while it runs.
pub struct DriverContext {
    /// The driver's region: value of input point `n` (counted over the input points alone) in cell `2n`, its quality in
    /// cell `2n + 1`.
    pub inputs: RegionWriter,
    /// What the output points are to show.
    pub outputs: Outputs,
    /// Plant time in ns.
    pub clock: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// Where events go. Never blocks.
    pub report: Box<dyn FnMut(IoEvent) + Send>,
    /// Turns true when the driver must write its safe values and return.
    pub stop: tokio::sync::watch::Receiver<bool>,
}

/// What one output point is to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Demand {
    /// The lane behind it runs: this value.
    Live(u64),
    /// The lane behind it has not executed yet: the safe value, or what the point is to show at first.
    First,
    /// The lane behind it has stopped or has faulted: the safe value.
    Safe,
}

/// The demands on a driver's output points.
pub struct Outputs {
    /// Entry `2n`: the value for output point `n`; entry `2n + 1`: the state of the lane that writes it, 1 = running.
    view: View,
}

impl Outputs {
    /// State of a lane, in the first cell of its region, that makes its outputs live.
    pub const RUNNING: u64 = 1;
    /// State of a lane that has not executed yet.
    pub const STARTING: u64 = 0;

    /// Over a view with two entries per output point: value and state of the lane behind it.
    pub fn new(view: View) -> Self {
        Self { view }
    }

    /// Takes a new snapshot.
    pub fn refresh(&mut self) {
        self.view.refresh();
    }

    /// Number of output points.
    pub fn len(&self) -> usize {
        self.view.len() / 2
    }

    /// True without output points.
    pub fn is_empty(&self) -> bool {
        self.view.is_empty()
    }

    /// What output point `n` (counted over the output points alone) is to show.
    pub fn demand(&self, n: usize) -> Demand {
        match self.view.cell(2 * n + 1) {
            Self::RUNNING => Demand::Live(self.view.cell(2 * n)),
            Self::STARTING => Demand::First,
            _ => Demand::Safe,
        }
    }
}

/// A driver that runs on the I/O thread.
///
/// However it ends (a stop, a panic, a cancelled run), its inputs must be bad afterwards: publish that in a `Drop`.
pub trait Driver: Send {
    /// True when its calls of the system may block for longer than a moment: it gets a thread of its own.
    fn blocks(&self) -> bool {
        false
    }

    /// Runs until `context.stop` turns true; then writes the safe values within a bounded time and returns.
    fn run(self: Box<Self>, context: DriverContext) -> Pin<Box<dyn Future<Output = ()> + Send>>;
}
