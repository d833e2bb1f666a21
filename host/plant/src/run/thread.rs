//! The thread of a lane: its priority, and what it waits for.

use super::Clock;
use super::watchdog::Watchdog;
use crate::lane::{FOLLOW, Lane, LaneState};
use crate::model;
use arrayvec::ArrayVec;
use rustix::event::{PollFd, PollFlags};
use rustix::time::Timespec;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// A lane looks for a stop at least this often, ns.
const NAP: u64 = 50_000_000;
/// Lines that failed to open are tried again, and lines that are open looked after, this often, ns.
const REOPEN: u64 = 1_000_000_000;
/// Levels that no edge brings are shown to other lanes this often, ns.
const REFRESH: u64 = 5_000_000;
/// The watchdog is petted at most so often, ns: its shortest timeout is some seconds.
const PET: u64 = 200_000_000;
/// Executions in a row after which an interrupt lane looks at everything else.
const IN_A_ROW: usize = 64;
/// Readings of its lines, a batch each, with which a lane ends.
const LAST_READS: usize = 64;
/// Lines that one lane waits for.
const MOST_LINES: usize = 256;

/// What a lane's thread needs besides the lane.
pub(super) struct Drive<'a> {
    pub(super) config: &'a model::Lane,
    /// Scans after which it ends.
    pub(super) scans: Option<u64>,
    pub(super) clock: &'a dyn Clock,
    /// True when it is to end.
    pub(super) stop: &'a dyn Fn() -> bool,
}

impl Drive<'_> {
    fn over(&self, lane: &Lane) -> bool {
        (self.stop)() || self.scans.is_some_and(|n| lane.statistics().scans >= n)
    }
}

/// One lane's thread; it gives the lane back, and the watchdog it has petted.
pub(super) fn drive(mut lane: Lane, mut watchdog: Option<Watchdog>, drive: &Drive<'_>) -> (Lane, Option<Watchdog>) {
    set_priority(&mut lane, drive);
    if let Some(work) = drive.clock.work() {
        lane.time_work_by(work);
    }
    if lane.is_interrupt() {
        wait(&mut lane, drive);
    } else {
        scan(&mut lane, watchdog.as_mut(), drive);
    }
    (lane, watchdog)
}

/// A cyclic lane: absolute deadlines.
fn scan(lane: &mut Lane, mut watchdog: Option<&mut Watchdog>, drive: &Drive<'_>) {
    let Drive { config, clock, .. } = *drive;
    let mut due = clock.now();
    let mut pet = due;
    loop {
        while clock.now() < due && !(drive.stop)() {
            clock.sleep_until(due.min(clock.now() + NAP));
        }
        // No record of this scan will be older. The mark comes before the scan's own look at the clock.
        lane.mark(clock.now());
        let now = clock.now();
        if drive.over(lane) {
            lane.stop(now);
            return;
        }
        if lane.scan(due, now, || clock.now()) == LaneState::Faulted {
            lane.mark(u64::MAX);
            return;
        }
        lane.mark(u64::MAX);
        let end = clock.now();
        // A scan that is late does not pet: a lane that is always late lets the machine be reset.
        if let Some(watchdog) = watchdog.as_mut().filter(|_| end >= pet && end <= due.saturating_add(config.every)) {
            pet = end.saturating_add(PET);
            // A device that fails resets the machine, which is what it is for.
            let _ = watchdog.pet();
        }
        due = super::next_due(due, end, config.every);
        lane.spare(due, || clock.now());
    }
}

/// An interrupt lane: waits in the kernel for its lines, for whoever wakes it, and for the next poll if it polls.
fn wait(lane: &mut Lane, drive: &Drive<'_>) {
    let clock = drive.clock;
    let polls = lane.polls();
    let mut reopen = open(lane, clock);
    lane.begin_interrupts(clock.now());
    let mut look = clock.now().saturating_add(REOPEN);
    let (mut follow, mut due, mut refresh) = (0, clock.now(), if lane.has_levels() && !polls { 0 } else { u64::MAX });
    loop {
        if polls {
            lane.mark(clock.now());
        }
        let now = clock.now();
        if drive.over(lane) {
            // What the kernel still keeps is told, too; a line without an end is a storm before it is read so often.
            lane.collect();
            let _ = (0..LAST_READS).find(|_| !lane.take_edges(now, true, |at| clock.plant_time(at)));
            lane.stop(clock.now());
            return;
        }
        if now >= reopen {
            reopen = open(lane, clock);
        }
        // What is held goes first: it is older than what is read now.
        lane.calm(now);
        lane.collect();
        // Lines in a storm are not waited for; they are read when they are due to be followed.
        let all = now >= follow;
        let more = lane.take_edges(now, all, |at| clock.plant_time(at));
        if all {
            follow = now.saturating_add(FOLLOW);
        }
        lane.calm(now);
        if polls && now >= due {
            if lane.begin_poll(due, clock.now(), &|| clock.now())
                && lane.end_activation(clock.now()) == LaneState::Faulted
            {
                return;
            }
            due = super::next_due(due, clock.now(), drive.config.every.max(1));
        }
        lane.mark_oldest();
        if more && lane.arrivals().is_some_and(|a| a.has_room()) {
            // An older edge of another line may be among those that have not been read.
            continue;
        }
        // Edges younger than the reading began wait: an older one may have come to a line right after it was read.
        let mut left = IN_A_ROW;
        while left > 0
            && let Some(arrival) = lane.next_arrival(now)
        {
            left -= 1;
            if lane.activate(arrival, clock.now(), || clock.now()) == LaneState::Faulted {
                return;
            }
        }
        lane.mark_oldest();
        if left == 0 || more {
            // There is no time, but a state is not put off for ever.
            if lane.spare(0, || clock.now()) == LaneState::Faulted {
                return;
            }
            continue;
        }
        if now >= look {
            lane.check_points(now);
            look = now.saturating_add(REOPEN);
            continue;
        }
        if now >= refresh {
            lane.refresh(now);
            refresh = now.saturating_add(REFRESH);
        }
        if !lane.points_healthy() {
            reopen = reopen.min(now.saturating_add(REOPEN));
        }
        let mut until = now.saturating_add(NAP).min(reopen).min(refresh).min(look);
        if polls {
            until = until.min(due);
        }
        if lane.in_storm() {
            until = until.min(follow);
        }
        if let Some(time) = lane.arrivals().and_then(|a| a.deadline().into_iter().chain(a.peek()).min()) {
            until = until.min(time);
        }
        if lane.spare(until, || clock.now()) == LaneState::Faulted {
            return;
        }
        sleep(lane, until.saturating_sub(clock.now()));
    }
}

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
    // The wake comes first; an edge costs no call for it.
    if descriptors.first().is_some_and(|wake| !wake.revents().is_empty()) {
        lane.awake();
    }
}

fn set_priority(lane: &mut Lane, drive: &Drive<'_>) {
    let Drive { config, clock, .. } = *drive;
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
