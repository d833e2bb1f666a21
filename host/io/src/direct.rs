//! The part of a driver that works in the thread of an interrupt lane: edges in, outputs out, nothing in between.
//!
//! An interrupt lane waits for the descriptors of its edge points, takes their edges, executes and writes its outputs,
//! all in its own thread. What belongs to such a lane is therefore not served by the I/O thread: the plant splits a
//! driver's points between its [`crate::driver::Driver`] and one `Direct` per interrupt lane.

use crate::driver::{DriverConfig, IoEvent};
use std::os::fd::BorrowedFd;

/// What an interrupt lane does with a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Its edges start the lane. The point's key `edge` says which: `both` (the default), `rising`, `falling`.
    Edge,
    /// Its level is read whenever the lane runs.
    Level,
    /// The lane writes it.
    Output,
}

/// One edge, as the kernel saw it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// The point, by its place in the configuration.
    pub point: usize,
    /// When it happened: CLOCK_MONOTONIC, ns.
    pub at: u64,
    /// The logical level after it (active-low is resolved).
    pub level: bool,
    /// Edges of this point that were lost right before this one.
    pub missed: u64,
}

/// Where events go.
pub type Report<'a> = &'a mut dyn FnMut(IoEvent);

/// Points in the hands of an interrupt lane.
///
/// However it ends (dropped in order, by a panic), its outputs must have their safe values afterwards: write them in a
/// `Drop`. Nothing here may block, and nothing but [`Self::open`] and the reporting of a failure may allocate.
pub trait Direct: Send {
    /// Opens what is not open: called at start, then about once a second while [`Self::healthy`] is false. While tries fail
    /// in the same way it may leave out calls. Outputs begin with their safe values. Reports what it could not open when
    /// that begins or its reason changes, not at every try, and what has come back.
    fn open(&mut self, report: Report<'_>);

    /// Called about once a second while nothing else happens: closes and reports what is gone, such as a chip of outputs alone
    /// that was unplugged while no output changed. Costs little and asks no device.
    fn check(&mut self, _report: Report<'_>) {}

    /// True when all points are open.
    fn healthy(&self) -> bool;

    /// True when a point is open and works; its quality is bad otherwise.
    fn good(&self, point: usize) -> bool;

    /// What becomes readable when edges of a point wait; `None` while it is closed.
    fn descriptor(&self, point: usize) -> Option<BorrowedFd<'_>>;

    /// Takes edges of a point that wait, oldest first, at most a batch of some dozens; returns true when there may be
    /// more. A point that fails is closed and reported.
    fn edges(&mut self, point: usize, take: &mut dyn FnMut(Edge), report: Report<'_>) -> bool;

    /// The present logical level of an edge or level point; `None` while it is closed.
    fn level(&mut self, point: usize, report: Report<'_>) -> Option<bool>;

    /// What the outputs are to show: one cell per output point, in their order in the configuration. Writes what differs
    /// from what they show, as far as possible in one step, and nothing else.
    fn write(&mut self, outputs: &[u64], report: Report<'_>);
}

/// Makes a `Direct` for some points of a driver; the roles go with the configuration's points. Nothing is opened yet.
pub type Build = fn(DriverConfig, Vec<Role>) -> Result<Box<dyn Direct>, String>;
