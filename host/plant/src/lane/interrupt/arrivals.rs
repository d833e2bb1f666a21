//! What waits for an interrupt lane: edges and ticks, handed out one at a time in the order of their times.
//!
//! Nothing is dropped in silence. An edge that the kernel lost, that finds the queue full or that belongs to a storm is
//! counted, and a record of kind `lost` names the line and the number. Of edges that must be left out the newest of each
//! line is held and handled later with its own time, so that the plant ends in the state that the field is in.

use super::storm::Bucket;
use latchwork_record::{Datum, Entry, Kind, Recorder, SourceId};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Period in which a line in a storm is followed, ns.
pub const FOLLOW: u64 = 10_000_000;
/// Ticks that may wait.
const TICKS: usize = 16;
/// Priority of a record about edges that were left out.
const PRIORITY: u8 = 200;

/// What an interrupt lane executes for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cause {
    /// An edge of an input.
    Edge {
        /// Number in `on`.
        input: u32,
        /// Level after it.
        level: bool,
    },
    /// The end of a scan of the lane it runs with, or the beginning of the run.
    Tick,
}

/// One thing that waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Arrival {
    /// When it happened, plant time in ns.
    pub time: u64,
    order: u64,
    /// What it is.
    pub cause: Cause,
}

/// One line.
struct Line {
    source: SourceId,
    bucket: Bucket,
    storm: bool,
    /// When a line in a storm is followed next.
    follow: u64,
    /// The newest edge that was left out.
    held: Option<(u64, bool)>,
    /// Edges that are left out for good, of a storm or of a full queue.
    left_out: u64,
}

/// Everything that waits for one interrupt lane. Never allocates after it was made.
pub struct Arrivals {
    waiting: BinaryHeap<Reverse<Arrival>>,
    lines: Vec<Line>,
    limit: usize,
    edges: usize,
    ticks: usize,
    order: u64,
    /// Lines in a storm or with an edge that is held.
    troubled: usize,
    /// Ticks that found too many waiting.
    late: u64,
}

impl Arrivals {
    /// For lines of these names, with room for `limit` edges and `storm_limit` edges a second on one line.
    pub fn new(sources: &[SourceId], limit: usize, storm_limit: u64) -> Self {
        let line = |source: &SourceId| Line {
            source: *source,
            bucket: Bucket::new(storm_limit),
            storm: false,
            follow: 0,
            held: None,
            left_out: 0,
        };
        Self {
            waiting: BinaryHeap::with_capacity(limit + sources.len() + TICKS),
            lines: sources.iter().map(line).collect(),
            limit,
            edges: 0,
            ticks: 0,
            order: 0,
            troubled: 0,
            late: 0,
        }
    }

    /// The name of a line as a source of records.
    pub(super) fn source(&self, input: u32) -> SourceId {
        self.lines[input as usize].source
    }

    /// True while a line is in a storm: nobody needs to hurry for its edges.
    pub fn in_storm(&self, input: u32) -> bool {
        self.lines[input as usize].storm
    }

    /// True while any line is in a storm.
    pub fn any_storm(&self) -> bool {
        self.troubled > 0 && self.lines.iter().any(|l| l.storm)
    }

    /// True while another edge finds room.
    pub fn has_room(&self) -> bool {
        self.edges < self.limit
    }

    /// An edge has happened.
    pub fn edge(&mut self, input: u32, time: u64, level: bool, missed: u64, recorder: &mut Recorder) {
        let full = self.edges >= self.limit;
        let line = &mut self.lines[input as usize];
        if missed > 0 && line.storm {
            line.left_out += missed;
        } else if missed > 0 {
            let text = format_args!("{missed} edges were lost before they could be read");
            recorder.push(lost(time, line.source, "gap", missed).text(text));
        }
        // What the kernel lost was work for the machine, too.
        let calm = line.bucket.take(time, missed.saturating_add(1));
        if !calm && !line.storm {
            self.troubled += usize::from(line.held.is_none());
            line.storm = true;
            line.follow = time.saturating_add(FOLLOW);
            let text = format_args!(
                "the line makes more edges than its limit; it is followed at {} a second until it calms down",
                1_000_000_000 / FOLLOW
            );
            recorder.push(lost(time, line.source, "storm", 0).text(text));
        }
        if line.storm || full || line.held.is_some() {
            let before = line.held.replace((time, level));
            line.left_out += u64::from(before.is_some());
            self.troubled += usize::from(before.is_none() && !line.storm);
            return;
        }
        self.push(time, Cause::Edge { input, level });
    }

    /// A scan of the lane it runs with has ended.
    pub fn tick(&mut self, time: u64) {
        if self.ticks >= TICKS {
            self.late += 1;
            return;
        }
        self.push(time, Cause::Tick);
    }

    fn push(&mut self, time: u64, cause: Cause) {
        match cause {
            Cause::Edge { .. } => self.edges += 1,
            Cause::Tick => self.ticks += 1,
        }
        self.order += 1;
        self.waiting.push(Reverse(Arrival { time, order: self.order, cause }));
    }

    /// Time of the oldest that waits or is held, ns: no record of this lane will be older.
    pub fn oldest(&self) -> Option<u64> {
        let waiting = self.waiting.peek().map(|w| w.0.time);
        if self.troubled == 0 {
            return waiting;
        }
        self.lines.iter().filter_map(|l| l.held.map(|(time, _)| time)).chain(waiting).min()
    }

    /// Time of what [`Self::next`] gives, ns.
    pub fn peek(&self) -> Option<u64> {
        self.waiting.peek().map(|w| w.0.time)
    }

    /// The oldest that waits.
    pub fn take(&mut self) -> Option<Arrival> {
        let Reverse(arrival) = self.waiting.pop()?;
        match arrival.cause {
            Cause::Edge { .. } => self.edges -= 1,
            Cause::Tick => self.ticks -= 1,
        }
        Some(arrival)
    }

    /// Ticks that were left out since the last call.
    pub(super) fn take_late(&mut self) -> u64 {
        std::mem::take(&mut self.late)
    }

    /// When [`Self::calm`] has something to do, if nothing else happens.
    pub fn deadline(&self) -> Option<u64> {
        if self.troubled == 0 {
            return None;
        }
        let of = |line: &Line| match (line.storm, line.held) {
            (true, Some(_)) => Some(line.follow.min(line.bucket.calm_at())),
            (true, None) => Some(line.bucket.calm_at()),
            (false, Some((time, _))) => Some(time),
            (false, None) => None,
        };
        self.lines.iter().filter_map(of).min()
    }

    /// Ends storms that are over and lets through what was held, as far as there is room.
    pub fn calm(&mut self, now: u64, recorder: &mut Recorder) {
        if self.troubled == 0 {
            return;
        }
        for input in 0..self.lines.len() {
            let room = self.edges < self.limit;
            let line = &mut self.lines[input];
            if !line.storm && line.held.is_none() {
                continue;
            }
            let over = line.storm && line.bucket.calm_at() <= now;
            let through = room && line.held.is_some() && (!line.storm || over || line.follow <= now);
            let full = line.held.is_some() && !line.storm;
            let source = line.source;
            let held = if through { line.held.take() } else { None };
            if through {
                line.follow = now.saturating_add(FOLLOW);
            }
            if over {
                line.storm = false;
                let count = std::mem::take(&mut line.left_out);
                let text = format_args!("the line has calmed down; {count} of its edges were left out");
                recorder.push(lost(now, source, "storm-end", count).text(text));
            } else if full && through {
                let count = std::mem::take(&mut line.left_out);
                if count > 0 {
                    let text = format_args!("{count} edges found the lane's queue full and were left out");
                    recorder.push(lost(now, source, "overflow", count).text(text));
                }
            }
            if !line.storm && line.held.is_none() {
                self.troubled -= 1;
            }
            if let Some((time, level)) = held {
                self.push(time, Cause::Edge { input: input as u32, level });
            }
        }
    }

    /// Tells what was left out or never handled, at the end of a run.
    pub(super) fn settle(&mut self, now: u64, recorder: &mut Recorder) {
        while let Some(arrival) = self.take() {
            if let Cause::Edge { input, .. } = arrival.cause {
                self.lines[input as usize].left_out += 1;
            }
        }
        for line in &mut self.lines {
            // Nobody handles the edge that is held any more.
            let count = std::mem::take(&mut line.left_out) + u64::from(line.held.take().is_some());
            if count > 0 {
                let text = format_args!("{count} edges were not handled when the lane ended");
                recorder.push(lost(now, line.source, "left-out", count).text(text));
            }
            line.storm = false;
        }
        self.troubled = 0;
    }
}

fn lost(time: u64, source: SourceId, transition: &'static str, count: u64) -> Entry {
    let count = i64::try_from(count).unwrap_or(i64::MAX);
    Entry::new(time, Kind::Lost, source, transition).priority(PRIORITY).change(Datum::None, Datum::Integer(count))
}
