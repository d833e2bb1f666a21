//! A part of the driver on the bench: its points, its events, what it took.

use crate::chip::Chip;
use latchwork_image::Type;
use latchwork_io::direct::{Direct, Edge, Role};
use latchwork_io::driver::{DriverConfig, DriverKind, IoEvent, PointConfig};
use latchwork_schema::{Value, Values};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::os::fd::BorrowedFd;
use std::time::Duration;

/// Keys of a point or driver.
pub(crate) type Keys<'a> = &'a [(&'a str, Value)];

pub(crate) fn text(t: &str) -> Value {
    Value::Text(t.into())
}

pub(crate) fn number(n: usize) -> Value {
    Value::Integer(n as i64)
}

fn values(keys: Keys<'_>) -> Values {
    Values { span: 0..0, entries: keys.iter().map(|(k, v)| ((*k).to_owned(), (v.clone(), 0..0))).collect() }
}

/// A point; `safe` makes it an output.
pub(crate) fn point(name: &str, keys: Keys<'_>, safe: Option<bool>) -> PointConfig {
    PointConfig { name: name.into(), values: values(keys), ty: Type::Bool, safe: safe.map(u64::from) }
}

pub(crate) fn kind() -> &'static DriverKind {
    latchwork_io::kinds::find("gpio").expect("the kind gpio")
}

/// The configuration of the driver `gpio` on a chip.
pub(crate) fn config(chip: &str, points: Vec<PointConfig>) -> DriverConfig {
    let config = DriverConfig { name: "gpio".into(), values: values(&[("chip", text(chip))]), points };
    assert_eq!((kind().check)(&config), [], "the probe's own configuration is right");
    config
}

/// The part of an interrupt lane, with what it reported.
pub(crate) struct Lane {
    pub(crate) direct: Box<dyn Direct>,
    pub(crate) events: Vec<IoEvent>,
}

impl Lane {
    /// Makes and opens it.
    pub(crate) fn open(chip: &str, points: Vec<(PointConfig, Role)>) -> Result<Self, String> {
        let (points, roles) = points.into_iter().unzip();
        let build = kind().direct.expect("gpio works in lanes");
        let mut lane = Self { direct: build(config(chip, points), roles)?, events: Vec::new() };
        lane.reopen();
        Ok(lane)
    }

    /// The same, and everything must be open.
    pub(crate) fn healthy(chip: &Chip, points: Vec<(PointConfig, Role)>) -> Result<Self, String> {
        let mut lane = Self::open(&chip.path(), points)?;
        if !lane.direct.healthy() {
            return Err(format!("not all is open: {:?}", lane.told()));
        }
        lane.events.clear();
        Ok(lane)
    }

    /// Half a minute passes, in which the lane calls once a second: longer than any pause between two tries.
    pub(crate) fn reopen(&mut self) {
        for _ in 0..31 {
            self.direct.open(&mut |e| self.events.push(e));
        }
    }

    /// A second passes in which nothing happens.
    pub(crate) fn idle(&mut self) {
        self.direct.check(&mut |e| self.events.push(e));
    }

    /// All edges that wait at a point.
    pub(crate) fn edges(&mut self, point: usize) -> Vec<Edge> {
        let mut edges = Vec::new();
        while self.direct.edges(point, &mut |e| edges.push(e), &mut |e| self.events.push(e)) {}
        edges
    }

    pub(crate) fn level(&mut self, point: usize) -> Option<bool> {
        self.direct.level(point, &mut |e| self.events.push(e))
    }

    pub(crate) fn write(&mut self, outputs: &[bool]) {
        let cells: Vec<u64> = outputs.iter().map(|o| u64::from(*o)).collect();
        self.direct.write(&cells, &mut |e| self.events.push(e));
    }

    /// Takes the events: `SOURCE TRANSITION: TEXT`.
    pub(crate) fn told(&mut self) -> Vec<String> {
        self.events.drain(..).map(|e| format!("{} {}: {}", e.source, e.transition, e.text)).collect()
    }

    /// Source and transition of the events, and takes them.
    pub(crate) fn transitions(&mut self) -> Vec<(String, &'static str)> {
        self.events.drain(..).map(|e| (e.source, e.transition)).collect()
    }
}

/// Waits until something can be read, or was hung up.
pub(crate) fn wait(descriptor: BorrowedFd<'_>, limit: Duration) -> PollFlags {
    let mut poll_fd = [PollFd::new(&descriptor, PollFlags::IN)];
    let limit = Timespec { tv_sec: limit.as_secs() as i64, tv_nsec: i64::from(limit.subsec_nanos()) };
    match poll(&mut poll_fd, Some(&limit)) {
        Ok(0) | Err(_) => PollFlags::empty(),
        Ok(_) => poll_fd[0].revents(),
    }
}
