//! What an interrupt lane hears of others: the end of a cyclic lane's scan, and values that model blocks feed into its
//! inputs.

use crate::layout::Probe;
use latchwork_image::Quality;
use latchwork_io::driver::PointConfig;
use rustix::event::{EventfdFlags, eventfd};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

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

    /// Whether a change to `level` starts the lane.
    pub fn starts(self, level: bool) -> bool {
        self == Self::Both || (self == Self::Rising) == level
    }
}

/// An input of an interrupt lane that no line makes: a stimulus or a feed does.
pub struct Simulated {
    /// Number in the lane's `on`.
    pub input: u32,
    /// Which changes start it.
    pub edge: EdgeKind,
    /// The level now, as the lane would read it from a line.
    pub level: Arc<AtomicBool>,
    /// Its quality now, as a cell.
    pub quality: Arc<AtomicU64>,
    /// Edges that found no room.
    pub missed: u64,
}

impl Simulated {
    /// Sets the level at plant time `now`; the event, if that is one. A point that is set to what it is makes none.
    pub fn set(&mut self, level: bool, now: u64, to: &mut Sender) -> bool {
        if self.level.swap(level, Ordering::Relaxed) == level || !self.edge.starts(level) {
            return false;
        }
        let event = Event::Edge { time: now, input: self.input, level, missed: self.missed };
        self.missed = if to.push(now, event) { 0 } else { self.missed + 1 };
        true
    }

    /// Sets the quality, which the lane shows whenever it executes; true when it was another one.
    pub fn qualify(&mut self, quality: Quality) -> bool {
        self.quality.swap(quality.cell(), Ordering::Relaxed) != quality.cell()
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

/// The way to an interrupt lane.
pub struct Sender {
    /// Events under way.
    pub events: rtrb::Producer<Event>,
    /// Its thread; none at virtual time.
    pub wake: Option<Arc<Wake>>,
    /// Time of the oldest record it may still make, ns.
    pub oldest: Arc<AtomicU64>,
}

impl Sender {
    /// Sends what happened at plant time `time`; false without room for it.
    #[inline]
    fn push(&mut self, time: u64, event: Event) -> bool {
        // Before the lane itself knows, nobody shall pass on younger records.
        self.oldest.fetch_min(time, Ordering::AcqRel);
        self.events.push(event).is_ok()
    }

    /// Lets the lane execute without an edge, at plant time `time`; false without room for it.
    pub(crate) fn tick(&mut self, time: u64) -> bool {
        self.push(time, Event::Tick { time })
    }

    /// Wakes the lane's thread.
    #[inline]
    pub(crate) fn wake(&self) {
        if let Some(wake) = &self.wake {
            wake.wake();
        }
    }
}

/// A tag that feeds an input of an interrupt lane (`[sim.feed]`).
pub struct Feed {
    /// The tag, as the feeding lane sees it.
    pub probe: Probe,
    /// The input.
    pub to: Simulated,
}

/// An interrupt lane that hears of a lane's scans.
pub struct Follower {
    /// It runs with this lane.
    pub ticks: bool,
    /// What this lane feeds.
    pub feeds: Vec<Feed>,
    /// The way there.
    pub to: Sender,
}

impl Follower {
    /// Tells the lane that a scan has ended at plant time `end`.
    #[inline]
    pub(super) fn notify(&mut self, end: u64, cells: &[u64]) {
        let mut told = false;
        for feed in &mut self.feeds {
            told |= feed.to.set(feed.probe.read(cells) & 1 == 1, end, &mut self.to);
        }
        if self.ticks {
            // A lane that is this far behind has many of them waiting; it counts its overruns itself.
            told |= self.to.push(end, Event::Tick { time: end });
        }
        if told {
            self.to.wake();
        }
    }
}
