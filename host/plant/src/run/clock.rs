//! The machine's clock, behind a trait: nothing in this crate reads a clock that it was not given.

use rustix::thread::ClockId;
use rustix::time::{Timespec, clock_gettime};

/// Plant time by some clock.
pub trait Clock: Send + Sync {
    /// Plant time, ns since the start.
    fn now(&self) -> u64;
    /// Plant time of a CLOCK_MONOTONIC time, ns: kernels stamp edges with that.
    fn plant_time(&self, monotonic: u64) -> u64;
    /// Sleeps until a plant time (absolute: no drift); returns early on a signal.
    fn sleep_until(&self, time: u64);
    /// What tells how long the calling thread has worked so far, ns: without what others did on its processor, or a machine
    /// that stood still. `None`: nothing does.
    fn work(&self) -> Option<fn() -> u64> {
        None
    }
}

/// CLOCK_MONOTONIC, 0 at its making.
pub struct MachineClock {
    start: u64,
}

fn monotonic() -> u64 {
    read(rustix::time::ClockId::Monotonic)
}

fn worked() -> u64 {
    read(rustix::time::ClockId::ThreadCPUTime)
}

fn read(clock: rustix::time::ClockId) -> u64 {
    let t = clock_gettime(clock);
    (t.tv_sec as u64).saturating_mul(1_000_000_000).saturating_add(t.tv_nsec as u64)
}

impl MachineClock {
    /// A clock that starts now.
    pub fn start() -> Self {
        Self { start: monotonic() }
    }
}

impl Clock for MachineClock {
    fn now(&self) -> u64 {
        monotonic().saturating_sub(self.start)
    }

    fn plant_time(&self, monotonic: u64) -> u64 {
        monotonic.saturating_sub(self.start)
    }

    fn sleep_until(&self, time: u64) {
        let at = self.start.saturating_add(time);
        let at = Timespec { tv_sec: (at / 1_000_000_000) as i64, tv_nsec: (at % 1_000_000_000) as i64 };
        // EINTR is an early return, which callers expect.
        let _ = rustix::thread::clock_nanosleep_absolute(ClockId::Monotonic, &at);
    }

    fn work(&self) -> Option<fn() -> u64> {
        Some(worked)
    }
}
