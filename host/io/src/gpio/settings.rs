//! What the keys of one point ask of the kernel.

use super::keys::{BUFFER, default_integer};
use gpiocdev::line::{Bias, Config, Drive, EdgeDetection, EventClock, Offset, Value};
use latchwork_schema::Values;
use std::fmt;
use std::time::Duration;

/// How a line is named.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Select {
    Number(Offset),
    Name(String),
}

impl fmt::Display for Select {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "line {number}"),
            Self::Name(name) => write!(f, "line \"{name}\""),
        }
    }
}

/// What a point's line is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// Its edges are taken, and its level is read.
    Edges,
    /// Its level is read.
    Level,
    /// It is driven.
    Output,
}

/// The keys of one point.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub(super) select: Select,
    pub(super) bias: Option<Bias>,
    pub(super) active_low: bool,
    pub(super) debounce: Option<Duration>,
    pub(super) edge: EdgeDetection,
    pub(super) drive: Drive,
    /// Edges the kernel keeps for us.
    pub(super) buffer: u32,
    /// Level of an output until the lane behind it has executed; the safe one without it.
    pub(super) initial: Option<bool>,
}

impl Settings {
    /// The settings of checked keys; `None` when they name no line.
    pub(super) fn of(values: &Values) -> Option<Self> {
        let select = match (values.integer("line"), values.text("line")) {
            (Some(number), _) => Select::Number(u32::try_from(number).ok()?),
            (None, Some(name)) if !name.is_empty() => Select::Name(name.to_owned()),
            _ => return None,
        };
        Some(Self {
            select,
            bias: match values.text("bias") {
                Some("pull-up") => Some(Bias::PullUp),
                Some("pull-down") => Some(Bias::PullDown),
                Some("disabled") => Some(Bias::Disabled),
                _ => None,
            },
            active_low: values.bool("active-low").unwrap_or(false),
            debounce: values.duration("debounce").filter(|d| *d > 0).map(Duration::from_nanos),
            edge: match values.text("edge") {
                Some("rising") => EdgeDetection::RisingEdge,
                Some("falling") => EdgeDetection::FallingEdge,
                _ => EdgeDetection::BothEdges,
            },
            drive: match values.text("drive") {
                Some("open-drain") => Drive::OpenDrain,
                Some("open-source") => Drive::OpenSource,
                _ => Drive::PushPull,
            },
            buffer: values.integer(BUFFER.name).unwrap_or_else(|| default_integer(&BUFFER)) as u32,
            initial: values.bool("initial"),
        })
    }

    /// The configuration of a line for a use; `level` is what an output begins with.
    pub(super) fn config(&self, usage: Use, level: bool) -> Config {
        let mut config = Config { active_low: self.active_low, ..Config::default() };
        match usage {
            Use::Output => {
                config.as_output(Value::from(level)).with_drive(self.drive);
            }
            Use::Level | Use::Edges => {
                config.as_input();
                config.debounce_period = self.debounce;
            }
        }
        if usage == Use::Edges {
            config.with_edge_detection(self.edge);
            config.event_clock = Some(EventClock::Monotonic);
        }
        config.bias = self.bias;
        config
    }

    /// Lines that agree in this cost a request one attribute together; see [`super::open`].
    pub(super) fn flags(&self) -> (bool, Option<Bias>, Drive) {
        (self.active_low, self.bias, self.drive)
    }
}
