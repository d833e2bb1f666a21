//! What an interrupt lane hears of others: the end of a cyclic lane's scan, and values that model blocks feed into its
//! inputs.

use crate::layout::Probe;
use latchwork_io::driver::PointConfig;
use rustix::event::{EventfdFlags, eventfd};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;

/// Something that has happened to an interrupt lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A change of an input.
    Edge {
        /// Plant time, ns.
        time: u64,
        /// Number in `on`.
        input: u32,
        /// Level after it.
        level: bool,
        /// Edges of this input that were lost right before.
        missed: u64,
    },
    /// A level that starts nothing: the other edge of an input with `edge = "rising"` or `"falling"`.
    Level {
        /// Number in `on`.
        input: u32,
        /// The level.
        level: bool,
    },
    /// The cyclic lane it runs with has ended a scan.
    Tick {
        /// Plant time, ns.
        time: u64,
    },
}

/// Which edges of an input start a lane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EdgeKind {
    /// Both.
    #[default]
    Both,
    /// From false to true.
    Rising,
    /// From true to false.
    Falling,
}

impl EdgeKind {
    /// From a point's key `edge`.
    pub fn of(point: &PointConfig) -> Self {
        match point.values.text("edge") {
            Some("rising") => Self::Rising,
            Some("falling") => Self::Falling,
            _ => Self::Both,
        }
    }

    /// What a change to `level` is to the lane.
    pub fn event(self, time: u64, input: u32, level: bool, missed: u64) -> Event {
        match (self, level) {
            (Self::Rising, false) | (Self::Falling, true) => Event::Level { input, level },
            _ => Event::Edge { time, input, level, missed },
        }
    }
}

/// Wakes the thread of an interrupt lane.
pub struct Wake(OwnedFd);

impl Wake {
    /// A new one.
    pub fn new() -> std::io::Result<Self> {
        Ok(Self(eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?))
    }

    /// Wakes the thread; once is enough for several reasons.
    pub fn wake(&self) {
        // It can only fail when so many wakes are under way that one more makes no difference.
        let _ = rustix::io::write(&self.0, &1u64.to_ne_bytes());
    }

    /// What becomes readable.
    pub fn descriptor(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }

    /// Takes all wakes so far.
    pub fn clear(&self) {
        // Nothing to read is as good.
        let _ = rustix::io::read(&self.0, &mut [0u8; 8]);
    }
}

/// A tag that feeds an input of an interrupt lane (`[sim.feed]`).
pub struct Feed {
    /// The tag, as the feeding lane sees it.
    pub probe: Probe,
    /// Number in the interrupt lane's `on`.
    pub input: u32,
    /// Which edges start the lane.
    pub edge: EdgeKind,
    /// Level so far.
    pub last: bool,
    /// Edges that found no room.
    pub missed: u64,
}

/// An interrupt lane that hears of a lane's scans.
pub struct Follower {
    /// It runs with this lane.
    pub ticks: bool,
    /// What this lane feeds.
    pub feeds: Vec<Feed>,
    /// The way there.
    pub events: rtrb::Producer<Event>,
    /// Its thread; none at virtual time.
    pub wake: Option<Arc<Wake>>,
}

impl Follower {
    /// Tells the lane that a scan has ended at plant time `end`.
    #[inline]
    pub(super) fn notify(&mut self, end: u64, cells: &[u64]) {
        let mut told = false;
        for feed in &mut self.feeds {
            let level = feed.probe.read(cells) & 1 == 1;
            if level != feed.last {
                feed.last = level;
                told = true;
                let event = feed.edge.event(end, feed.input, level, feed.missed);
                feed.missed = if self.events.push(event).is_ok() { 0 } else { feed.missed + 1 };
            }
        }
        if self.ticks {
            // A lane that is this far behind has many of them waiting; it counts its overruns itself.
            told |= self.events.push(Event::Tick { time: end }).is_ok();
        }
        if told && let Some(wake) = &self.wake {
            wake.wake();
        }
    }
}
