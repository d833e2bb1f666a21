//! The part in an interrupt lane.

use super::port::Port;
use super::settings::Use;
use crate::direct::{Direct, Edge, Report, Role};
use crate::driver::DriverConfig;
use std::os::fd::BorrowedFd;

/// Points of one interrupt lane. Its outputs get their safe values when it is dropped, before their lines are released.
pub(super) struct Lane {
    port: Port,
    /// It has written its outputs.
    begun: bool,
}

impl Lane {
    pub(super) fn new(config: &DriverConfig, roles: &[Role]) -> Result<Self, String> {
        if roles.len() != config.points.len() {
            return Err(format!("{} points have {} roles", config.points.len(), roles.len()));
        }
        let usage = |n: usize| match roles[n] {
            Role::Edge => Use::Edges,
            Role::Level => Use::Level,
            Role::Output => Use::Output,
        };
        Ok(Self { port: Port::new(config, usage)?, begun: false })
    }
}

impl Direct for Lane {
    fn open(&mut self, report: Report<'_>) {
        self.port.open(1, report);
    }

    fn check(&mut self, report: Report<'_>) {
        self.port.check(report);
    }

    fn healthy(&self) -> bool {
        self.port.is_open()
    }

    fn good(&self, point: usize) -> bool {
        self.port.is_good(point)
    }

    fn descriptor(&self, point: usize) -> Option<BorrowedFd<'_>> {
        self.port.descriptor(point)
    }

    fn edges(&mut self, point: usize, take: &mut dyn FnMut(Edge), report: Report<'_>) -> bool {
        self.port.edges(point, take, report)
    }

    fn level(&mut self, point: usize, report: Report<'_>) -> Option<bool> {
        self.port.level(point, report)
    }

    fn write(&mut self, outputs: &[u64], report: Report<'_>) {
        if !std::mem::replace(&mut self.begun, true) {
            self.port.lines.iter_mut().for_each(|line| line.begun = true);
        }
        self.port.write(outputs, report);
    }
}
