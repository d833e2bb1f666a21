//! The checked model of a plant: what the plant file says, with every name resolved and every type agreed.
//!
//! It is made by [`crate::check`] and only from a file without errors; assembly and lanes trust it.

mod alarms;
mod supervision;

pub use alarms::{AlarmRule, Variable};
pub use supervision::{Heartbeat, Recording, StatusTable};

use crate::operate::Policy;
use latchwork_block::{Class, Component};
use latchwork_image::Type;
use latchwork_io::direct::Role;
use latchwork_io::driver::{DriverConfig, DriverKind};
use latchwork_record::journal;
use latchwork_sink::{Config, SinkKind};
use std::path::PathBuf;
use std::sync::Arc;

/// A plant, checked.
#[derive(Clone)]
pub struct Model {
    /// `[plant] name`.
    pub name: String,
    /// The plant file.
    pub file: PathBuf,
    /// Lanes in the order of the file.
    pub lanes: Vec<Lane>,
    /// Drivers in the order of the file.
    pub drivers: Vec<Driver>,
    /// Blocks in the order of the file, with those of `[sim.block]` under `--sim`.
    pub blocks: Vec<Block>,
    /// Every driver is replaced by `sim`.
    pub sim: bool,
    /// Hardware watchdog and its timeout, ns.
    pub watchdog: Option<(PathBuf, u64)>,
    /// Who may do what with it while it runs.
    pub policy: Policy,
    /// Rules for alarms and commands, in the order of the file.
    pub alarm_rules: Vec<AlarmRule>,
    /// Alarm variables, then command variables, by block; then the other tags that rules name.
    pub variables: Vec<Variable>,
    /// Status tables, in the order of the file.
    pub tables: Vec<StatusTable>,
    /// Signs of life.
    pub heartbeat: Heartbeat,
    /// What the flight recorder records.
    pub recorder: Option<Recording>,
    /// Sinks in the order of the file.
    pub sinks: Vec<SinkSpec>,
    /// How its journal works, if one is kept.
    pub journal: journal::Options,
}

/// One sink.
#[derive(Clone)]
pub struct SinkSpec {
    /// Its kind.
    pub kind: &'static SinkKind,
    /// Name and keys.
    pub config: Config,
}

/// One lane.
#[derive(Clone, Debug)]
pub struct Lane {
    /// Name.
    pub name: String,
    /// Period, ns; of an interrupt lane the period of its polling, or 0.
    pub every: u64,
    /// What makes it an interrupt lane.
    pub interrupt: Option<Interrupt>,
    /// Points it serves itself, without the I/O thread: edges first, in the order of `on`.
    pub served: Vec<Served>,
    /// Virtual time its scans take, in turn, ns; empty: none.
    pub scan_times: Vec<u64>,
    /// A scan longer than this is a fault of the lane, ns.
    pub watchdog: u64,
    /// SCHED_FIFO priority 1–99.
    pub priority: u8,
    /// CPU the lane is pinned to.
    pub cpu: Option<usize>,
}

/// What makes a lane an interrupt lane.
#[derive(Clone, Debug)]
pub struct Interrupt {
    /// Input points that start it: driver and point.
    pub on: Vec<(usize, usize)>,
    /// It polls them at its period instead of waiting for edges.
    pub poll: bool,
    /// Cyclic lane with which it also runs.
    pub also_with: Option<usize>,
    /// Edges per second of one line beyond which that is a storm.
    pub storm_limit: u64,
    /// Edges that may wait.
    pub queue: usize,
}

/// A point that an interrupt lane serves itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Served {
    /// Driver.
    pub driver: usize,
    /// Point of the driver.
    pub point: usize,
    /// What the lane does with it.
    pub role: Role,
}

/// One driver.
#[derive(Clone)]
pub struct Driver {
    /// Its kind in the file, also when the plant runs with `--sim`.
    pub kind: &'static DriverKind,
    /// Name, keys and points.
    pub config: DriverConfig,
    /// Per point: the tag an output point shows (`from`), the tag that feeds an input point (`[sim.feed]`, only under
    /// `--sim` or for `sim` drivers).
    pub sources: Vec<Option<Wire>>,
}

/// One block.
#[derive(Clone)]
pub struct Block {
    /// Name, may have dots.
    pub name: String,
    /// Its component as the plant file names it.
    pub named: String,
    /// The component it is an instance of.
    pub component: Component,
    /// The device class it is used as.
    pub class: Arc<Class>,
    /// Index of its lane.
    pub lane: usize,
    /// Source per input port of the class.
    pub inputs: Vec<Input>,
    /// Cell per settings port; `None` where the file is silent: the component's default, or 0.
    pub settings: Vec<Option<u64>>,
    /// Cell per output port under `on-fault = "safe"`; 0 where the file is silent.
    pub safe: Vec<u64>,
    /// What its outputs do after a fault.
    pub on_fault: OnFault,
    /// Longest execution, ns.
    pub budget: u64,
    /// Most linear memory, bytes.
    pub memory: u64,
    /// Its retained state outlives a restart.
    pub retain: bool,
    /// It exists only under `--sim`.
    pub sim: bool,
}

/// Outputs after a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OnFault {
    /// Keep the last values.
    Hold,
    /// Take the `safe` values.
    Safe,
    /// Stop the whole lane; all its outputs take their safe values.
    StopLane,
}

/// Source of an input port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Input {
    /// Nothing is wired: the port reads 0 or false, a signal with quality bad.
    Unwired,
    /// A constant cell, quality good.
    Constant(u64),
    /// A tag.
    Wire(Wire),
}

/// A reference to a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wire {
    /// The tag.
    pub tag: TagRef,
    /// Bool inverted.
    pub not: bool,
}

/// A tag by what it is; numbers are indices into the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TagRef {
    /// `DRIVER.POINT`
    Point {
        /// Driver.
        driver: usize,
        /// Point of the driver.
        point: usize,
    },
    /// `BLOCK.inputs.PORT`
    Input {
        /// Block.
        block: usize,
        /// Port of the class's inputs.
        port: usize,
    },
    /// `BLOCK.outputs.PORT`
    Output {
        /// Block.
        block: usize,
        /// Port of the class's outputs.
        port: usize,
    },
    /// `BLOCK.alarms.NAME`
    Alarm {
        /// Block.
        block: usize,
        /// Bit of the alarms word.
        bit: u8,
    },
    /// `BLOCK.commands.NAME`
    Command {
        /// Block.
        block: usize,
        /// Bit of the commands word.
        bit: u8,
    },
    /// `BLOCK.settings.NAME`
    Setting {
        /// Block.
        block: usize,
        /// Port of the class's settings.
        port: usize,
    },
    /// `lane.NAME.STATISTIC`
    Lane {
        /// Lane.
        lane: usize,
        /// Which figure.
        statistic: Statistic,
    },
}

/// A figure that every lane keeps of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Statistic {
    /// Scans since the start.
    Scans,
    /// Scans longer than the period.
    Overruns,
    /// Duration of the last scan.
    ScanTime,
    /// Longest scan.
    ScanTimeMax,
    /// Latest start of a scan after its deadline.
    JitterMax,
    /// Faults of the lane's blocks and of the lane itself.
    Faults,
}

impl Statistic {
    /// All, in the order of their cells.
    pub const ALL: [Self; 6] =
        [Self::Scans, Self::Overruns, Self::ScanTime, Self::ScanTimeMax, Self::JitterMax, Self::Faults];

    /// Name in the tag.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scans => "scans",
            Self::Overruns => "overruns",
            Self::ScanTime => "scan-time",
            Self::ScanTimeMax => "scan-time-max",
            Self::JitterMax => "jitter-max",
            Self::Faults => "faults",
        }
    }

    /// Type of the tag: a count, or a duration.
    pub fn ty(self) -> Type {
        match self {
            Self::Scans | Self::Overruns | Self::Faults => Type::U64,
            Self::ScanTime | Self::ScanTimeMax | Self::JitterMax => Type::Duration,
        }
    }
}

impl Driver {
    /// The plant itself serves its points, no device does.
    pub fn simulated(&self, sim: bool) -> bool {
        sim || self.kind.name == "sim"
    }
}

impl Model {
    /// The interrupt lane that serves a point itself.
    pub fn server(&self, driver: usize, point: usize) -> Option<usize> {
        self.lanes.iter().position(|l| l.served.iter().any(|s| (s.driver, s.point) == (driver, point)))
    }

    /// The input points of a driver that no interrupt lane serves, in their order: those of its region.
    pub fn region_inputs(&self, driver: usize) -> impl Iterator<Item = usize> {
        let points = &self.drivers[driver].config.points;
        (0..points.len()).filter(move |p| points[*p].safe.is_none() && self.server(driver, *p).is_none())
    }

    /// Full name of a tag.
    pub fn tag_name(&self, tag: TagRef) -> String {
        match tag {
            TagRef::Point { driver, point } => {
                let config = &self.drivers[driver].config;
                format!("{}.{}", config.name, config.points[point].name)
            }
            TagRef::Input { block, port } => {
                let b = &self.blocks[block];
                format!("{}.inputs.{}", b.name, b.class.inputs[port].path)
            }
            TagRef::Output { block, port } => {
                let b = &self.blocks[block];
                format!("{}.outputs.{}", b.name, b.class.outputs[port].path)
            }
            TagRef::Alarm { block, bit } => {
                let b = &self.blocks[block];
                format!("{}.alarms.{}", b.name, b.class.alarms[usize::from(bit)])
            }
            TagRef::Command { block, bit } => {
                let b = &self.blocks[block];
                format!("{}.commands.{}", b.name, b.class.commands[usize::from(bit)])
            }
            TagRef::Setting { block, port } => {
                let b = &self.blocks[block];
                format!("{}.settings.{}", b.name, b.class.settings[port].path)
            }
            TagRef::Lane { lane, statistic } => format!("lane.{}.{}", self.lanes[lane].name, statistic.name()),
        }
    }

    /// Type of a tag.
    pub fn tag_type(&self, tag: TagRef) -> Type {
        match tag {
            TagRef::Point { driver, point } => self.drivers[driver].config.points[point].ty.clone(),
            TagRef::Input { block, port } => self.blocks[block].class.inputs[port].ty.clone(),
            TagRef::Output { block, port } => self.blocks[block].class.outputs[port].ty.clone(),
            TagRef::Setting { block, port } => self.blocks[block].class.settings[port].ty.clone(),
            TagRef::Alarm { .. } | TagRef::Command { .. } => Type::Bool,
            TagRef::Lane { statistic, .. } => statistic.ty(),
        }
    }
}
