//! What a plant needs of its machine, apart from the plant file.

use std::path::PathBuf;

/// What a plant needs.
#[derive(Clone, Debug, Default)]
pub(crate) struct Needs {
    /// Its lanes.
    pub(crate) lanes: Vec<LaneNeeds>,
    /// Drivers of kind `gpio`: name, and the chip as the plant file names it.
    pub(crate) gpio: Vec<(String, Option<String>)>,
    /// Drivers of kind `rppal`, by name.
    pub(crate) rppal: Vec<String>,
    /// Lines of its points, of both kinds of drivers.
    pub(crate) lines: Vec<LineNeeds>,
    /// Serial ports.
    pub(crate) serial: Vec<PathBuf>,
    /// The watchdog device.
    pub(crate) watchdog: Option<PathBuf>,
}

/// A line that a point needs.
#[derive(Clone, Debug)]
pub(crate) struct LineNeeds {
    /// The point, as `DRIVER.POINT`.
    pub(crate) point: String,
    /// The chip as the plant file names it; `None` for the chip of a Raspberry Pi's pins.
    pub(crate) chip: Option<String>,
    /// The line.
    pub(crate) line: LineName,
}

/// How a line is named.
#[derive(Clone, Debug)]
pub(crate) enum LineName {
    /// By its number on the chip.
    Number(u32),
    /// By its name.
    Name(String),
}

impl std::fmt::Display for LineName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => write!(f, "line {number}"),
            Self::Name(name) => write!(f, "line \"{name}\""),
        }
    }
}

/// What a lane needs.
#[derive(Clone, Debug)]
pub(crate) struct LaneNeeds {
    /// Name.
    pub(crate) name: String,
    /// SCHED_FIFO priority, 1–99.
    pub(crate) priority: u8,
    /// CPU it is pinned to.
    pub(crate) cpu: Option<usize>,
    /// What starts it.
    pub(crate) kind: LaneKind,
}

/// What starts a lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LaneKind {
    /// Its period.
    Cyclic,
    /// Edges, through the kernel.
    Edges,
    /// Changes that it polls for.
    Poll,
}

impl LaneNeeds {
    /// An interrupt lane of either kind.
    pub(super) fn is_interrupt(&self) -> bool {
        self.kind != LaneKind::Cyclic
    }
}

impl Needs {
    /// It has an interrupt lane.
    pub(super) fn interrupt(&self) -> bool {
        self.lanes.iter().any(LaneNeeds::is_interrupt)
    }

    /// Highest priority of its lanes.
    pub(super) fn priority(&self) -> Option<u8> {
        self.lanes.iter().map(|l| l.priority).max()
    }

    /// CPUs its lanes are pinned to, each once, in order.
    pub(super) fn cpus(&self) -> Vec<usize> {
        let mut cpus: Vec<usize> = self.lanes.iter().filter_map(|l| l.cpu).collect();
        cpus.sort_unstable();
        cpus.dedup();
        cpus
    }
}
