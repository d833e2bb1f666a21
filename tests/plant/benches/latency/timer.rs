//! A line whose edges a kernel timer makes: they wake the lane as a GPIO interrupt would, and their times are known.

use latchwork_io::direct::{Direct, Edge, Report};
use rustix::time::{
    Itimerspec, TimerfdClockId, TimerfdFlags, TimerfdTimerFlags, Timespec, timerfd_create, timerfd_settime,
};
use std::collections::VecDeque;
use std::fs::File;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// CLOCK_MONOTONIC, ns.
pub(crate) fn monotonic() -> u64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    t.tv_sec as u64 * 1_000_000_000 + t.tv_nsec as u64
}

fn timespec(ns: u64) -> Timespec {
    Timespec { tv_sec: (ns / 1_000_000_000) as i64, tv_nsec: (ns % 1_000_000_000) as i64 }
}

/// The timer and what was measured with it, shared with whoever arms it.
pub(crate) struct Line {
    timer: OwnedFd,
    first: AtomicU64,
    interval: AtomicU64,
    samples: Box<[AtomicU64]>,
    taken: AtomicUsize,
    /// Edges that the timer has made.
    pub(crate) edges: AtomicUsize,
}

impl Line {
    /// For so many edges: what the timer makes beyond them is no edge.
    pub(crate) fn new(room: usize) -> Arc<Self> {
        let timer = timerfd_create(TimerfdClockId::Monotonic, TimerfdFlags::NONBLOCK | TimerfdFlags::CLOEXEC);
        Arc::new(Self {
            timer: timer.expect("a timer"),
            first: AtomicU64::new(0),
            interval: AtomicU64::new(0),
            samples: (0..room).map(|_| AtomicU64::new(0)).collect(),
            taken: AtomicUsize::new(0),
            edges: AtomicUsize::new(0),
        })
    }

    /// Edges from `first` (CLOCK_MONOTONIC, ns) on; every `interval` ns, or one only with 0.
    pub(crate) fn arm(&self, first: u64, interval: u64) {
        self.first.store(first, Ordering::SeqCst);
        self.interval.store(interval, Ordering::SeqCst);
        let spec = Itimerspec { it_interval: timespec(interval), it_value: timespec(first) };
        timerfd_settime(&self.timer, TimerfdTimerFlags::ABSTIME, &spec).expect("a timer that is set");
    }

    /// Times from edge to output so far, ns; true for edges that woke the lane, false for those that it found waiting.
    pub(crate) fn samples(&self) -> impl Iterator<Item = (u64, bool)> {
        let taken = self.taken.load(Ordering::SeqCst).min(self.samples.len());
        self.samples[..taken].iter().map(|s| s.load(Ordering::Relaxed)).map(|s| (s >> 1, s & 1 == 1))
    }
}

/// The lane's side of it.
pub(crate) struct TimerLine {
    line: Arc<Line>,
    level: bool,
    passed: u64,
    armed: u64,
    /// Edges whose outputs have not come yet; true for those that woke the lane.
    open: VecDeque<(u64, bool)>,
    shown: u64,
    /// Takes the system call that a GPIO line would take.
    output: File,
}

impl TimerLine {
    pub(crate) fn new(line: Arc<Line>) -> Self {
        let output = File::options().write(true).open("/dev/null").expect("/dev/null");
        Self { line, level: false, passed: 0, armed: 0, open: VecDeque::with_capacity(65_536), shown: 0, output }
    }
}

impl Direct for TimerLine {
    fn open(&mut self, _: Report<'_>) {}

    fn healthy(&self) -> bool {
        true
    }

    fn good(&self, _: usize) -> bool {
        true
    }

    fn descriptor(&self, point: usize) -> Option<BorrowedFd<'_>> {
        (point == 0).then(|| self.line.timer.as_fd())
    }

    fn edges(&mut self, point: usize, take: &mut dyn FnMut(Edge), _: Report<'_>) -> bool {
        let mut count = [0; 8];
        if point != 0 || rustix::io::read(&self.line.timer, &mut count).is_err() {
            return false;
        }
        let first = self.line.first.load(Ordering::SeqCst);
        if std::mem::replace(&mut self.armed, first) != first {
            self.passed = 0;
        }
        for n in 0..u64::from_ne_bytes(count) {
            if self.line.edges.load(Ordering::Relaxed) >= self.line.samples.len() {
                break;
            }
            let at = first + self.passed * self.line.interval.load(Ordering::SeqCst);
            self.passed += 1;
            self.level = !self.level;
            self.open.push_back((at, n == 0));
            self.line.edges.fetch_add(1, Ordering::Relaxed);
            take(Edge { point: 0, at, level: self.level, missed: 0 });
        }
        false
    }

    fn level(&mut self, _: usize, _: Report<'_>) -> Option<bool> {
        Some(self.level)
    }

    fn write(&mut self, outputs: &[u64], _: Report<'_>) {
        if outputs[0] == self.shown {
            return;
        }
        self.shown = outputs[0];
        rustix::io::write(&self.output, &[self.shown as u8]).expect("/dev/null takes all");
        let Some((at, woke)) = self.open.pop_front() else { return };
        let taken = self.line.taken.fetch_add(1, Ordering::Relaxed);
        if let Some(sample) = self.line.samples.get(taken) {
            sample.store(monotonic().saturating_sub(at) << 1 | u64::from(woke), Ordering::Relaxed);
        }
    }
}
