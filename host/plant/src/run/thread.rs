//! The thread of a lane: its priority, and what it waits for.

use super::Clock;
use super::watchdog::Watchdog;
use crate::lane::{Lane, LaneState};
use crate::model;
use arrayvec::ArrayVec;
use rustix::event::{PollFd, PollFlags};
use rustix::time::Timespec;
use std::sync::atomic::{AtomicBool, Ordering};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// A lane looks for a stop at least this often, ns.
const NAP: u64 = 50_000_000;
/// Lines that failed to open are tried again this often, ns.
const REOPEN: u64 = 1_000_000_000;
/// The watchdog is petted at most so often, ns: its shortest timeout is a second.
const PET: u64 = 200_000_000;
/// Executions in a row after which an interrupt lane looks for younger edges of other lines.
const IN_A_ROW: usize = 64;
/// Lines that one lane waits for.
const MOST_LINES: usize = 256;

/// One lane's thread; it gives the lane back, and the watchdog it has petted.
pub(super) fn drive(
    mut lane: Lane,
    mut watchdog: Option<Watchdog>,
    config: &model::Lane,
    scans: Option<u64>,
    clock: &dyn Clock,
    stop: &AtomicBool,
) -> (Lane, Option<Watchdog>) {
    set_priority(&mut lane, config, clock);
    if lane.polls() {
        poll(&mut lane, config, scans, clock, stop);
    } else if lane.is_interrupt() {
        wait(&mut lane, scans, clock, stop);
    } else {
        scan(&mut lane, watchdog.as_mut(), config, scans, clock, stop);
    }
    (lane, watchdog)
}

/// A cyclic lane: absolute deadlines.
fn scan(
    lane: &mut Lane,
    mut watchdog: Option<&mut Watchdog>,
    config: &model::Lane,
    scans: Option<u64>,
    clock: &dyn Clock,
    stop: &AtomicBool,
) {
    let mut due = clock.now();
    let mut pet = due;
    loop {
        while clock.now() < due && !stop.load(Ordering::Relaxed) {
            clock.sleep_until(due.min(clock.now() + NAP));
        }
        if stop.load(Ordering::Relaxed) || scans.is_some_and(|n| lane.statistics().scans >= n) {
            lane.stop(clock.now());
            return;
        }
        let now = clock.now();
        if lane.scan(due, now, || clock.now()) == LaneState::Faulted {
            return;
        }
        let end = clock.now();
        // A scan that is late does not pet: a lane that is always late lets the machine be reset.
        if let Some(watchdog) = watchdog.as_mut().filter(|_| end >= pet && end <= due.saturating_add(config.every)) {
            pet = end.saturating_add(PET);
            // A device that fails resets the machine, which is what it is for.
            let _ = watchdog.pet();
        }
        due = super::next_due(due, end, config.every);
    }
}

/// An interrupt lane with edges: waits in the kernel for its lines and for whoever wakes it.
fn wait(lane: &mut Lane, scans: Option<u64>, clock: &dyn Clock, stop: &AtomicBool) {
    let mut reopen = open(lane, clock);
    lane.begin_interrupts(clock.now());
    let over = |lane: &Lane| stop.load(Ordering::Relaxed) || scans.is_some_and(|n| lane.statistics().scans >= n);
    let mut follow = 0;
    loop {
        let now = clock.now();
        if over(lane) {
            lane.stop(now);
            return;
        }
        if now >= reopen {
            reopen = open(lane, clock);
        }
        lane.collect();
        // Lines in a storm are not waited for; they are read when they are due to be followed.
        let all = now >= follow;
        let more = lane.take_edges(now, all, |at| clock.plant_time(at));
        if all {
            follow = now.saturating_add(FOLLOW);
        }
        lane.calm(now);
        lane.mark_oldest();
        let mut left = IN_A_ROW;
        while left > 0
            && let Some(arrival) = lane.next_arrival()
        {
            left -= 1;
            if lane.activate(arrival, clock.now(), || clock.now()) == LaneState::Faulted {
                return;
            }
        }
        if more || left == 0 {
            continue;
        }
        lane.mark_oldest();
        let now = clock.now();
        let mut until = now.saturating_add(NAP);
        if !lane.points_healthy() {
            reopen = reopen.min(now.saturating_add(REOPEN));
            until = until.min(reopen);
        }
        if let Some(deadline) = lane.arrivals().and_then(|a| a.deadline()) {
            until = until.min(deadline.max(follow));
        }
        sleep(lane, until.saturating_sub(now));
    }
}

/// How often lines in a storm are read, ns.
const FOLLOW: u64 = 10_000_000;

/// Opens what is not open; when to try again.
fn open(lane: &mut Lane, clock: &dyn Clock) -> u64 {
    let now = clock.now();
    if lane.open_points(now) { u64::MAX } else { now.saturating_add(REOPEN) }
}

/// Waits in the kernel at most so long, ns.
fn sleep(lane: &Lane, ns: u64) {
    let mut descriptors: ArrayVec<PollFd<'_>, { MOST_LINES + 1 }> = ArrayVec::new();
    lane.descriptors(|d| {
        // What finds no room is looked at after every nap.
        let _ = descriptors.try_push(PollFd::from_borrowed_fd(d, PollFlags::IN));
    });
    let limit = Timespec { tv_sec: (ns / 1_000_000_000) as i64, tv_nsec: (ns % 1_000_000_000) as i64 };
    // A signal is an early return, which the caller expects.
    let _ = rustix::event::poll(&mut descriptors, Some(&limit));
    lane.awake();
}

/// An interrupt lane that polls.
fn poll(lane: &mut Lane, config: &model::Lane, scans: Option<u64>, clock: &dyn Clock, stop: &AtomicBool) {
    let mut reopen = open(lane, clock);
    let mut due = clock.now();
    loop {
        while clock.now() < due && !stop.load(Ordering::Relaxed) {
            clock.sleep_until(due.min(clock.now() + NAP));
        }
        let now = clock.now();
        if stop.load(Ordering::Relaxed) || scans.is_some_and(|n| lane.statistics().scans >= n) {
            lane.stop(now);
            return;
        }
        if now >= reopen || (reopen == u64::MAX && !lane.points_healthy()) {
            reopen = open(lane, clock);
        }
        lane.collect();
        if lane.begin_poll(due, clock.now()) && lane.end_activation(clock.now()) == LaneState::Faulted {
            return;
        }
        while let Some(arrival) = lane.next_arrival() {
            if lane.activate(arrival, clock.now(), || clock.now()) == LaneState::Faulted {
                return;
            }
        }
        due = super::next_due(due, clock.now(), config.every.max(1));
    }
}

fn set_priority(lane: &mut Lane, config: &model::Lane, clock: &dyn Clock) {
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let priority = thread_priority::ThreadPriorityValue::try_from(config.priority);
    let set = priority.map_err(|e| e.to_string()).and_then(|p| {
        set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(p), policy)
            .map_err(|e| format!("{e:?}"))
    });
    if let Err(why) = set {
        lane.note(
            clock.now(),
            "no-real-time",
            format_args!(
                "SCHED_FIFO priority {} was refused ({why}): the lane runs with ordinary priority and may be late; allow it \
                 with `setcap cap_sys_nice+ep` or an rtprio limit",
                config.priority
            ),
        );
    }
    if let Some(cpu) = config.cpu {
        let mut set = rustix::thread::CpuSet::new();
        set.set(cpu);
        if let Err(error) = rustix::thread::sched_setaffinity(None, &set) {
            lane.note(
                clock.now(),
                "not-pinned",
                format_args!("cpu = {cpu} was refused ({error}); any CPU runs the lane"),
            );
        }
    }
}
