//! One block: from the frames of its tap to segments.

use super::Wire;
use crate::lane::{Frame, TapState};
use latchwork_block::FaultKind;
use latchwork_testbed::replay::{Event, Head, Segment, Start, Writer};

/// One recorded block.
pub(super) struct Channel {
    block: usize,
    lane: usize,
    place: u32,
    /// The version that executes, before it one that waits whether it comes back, behind it one that comes.
    streams: Vec<Stream>,
    /// Number of its next segment.
    number: u64,
    /// When its next state is due, plant time, ns.
    due: u64,
    /// When a state was asked for that has not come.
    asked: Option<u64>,
    /// Something has happened since the last state.
    changed: bool,
    /// Versions, and whether their states can be saved, once that is known.
    saves: Vec<(u64, Option<bool>)>,
}

/// What one version of it does.
struct Stream {
    wire: Wire,
    /// Nothing more will come than what is on the tape.
    gone: bool,
    /// What it was told while it waits: part of its story only if it comes back.
    held: Vec<Held>,
    /// Where the next segment stands, until a state has come.
    head: Option<Head>,
    writer: Option<Writer>,
    /// Another version executes.
    waits: bool,
    /// Number of the version.
    version: u64,
    /// Hash of its component.
    hash: String,
}

/// Settings that a version got while another one executed, and the frames missed before them.
struct Held {
    missed: u32,
    cells: Vec<u64>,
    taken: Result<bool, FaultKind>,
}

/// What a turn has brought.
#[derive(Default)]
pub(super) struct Turn {
    pub(super) segments: Vec<Segment>,
    pub(super) missed: u64,
    pub(super) faulted: bool,
    /// A version is over.
    pub(super) ended: bool,
}

impl Channel {
    pub(super) fn new(block: usize, lane: usize, place: u32, due: u64) -> Self {
        let streams = Vec::new();
        Self { block, lane, place, streams, number: 0, due, asked: None, changed: false, saves: Vec::new() }
    }

    /// Block of the model.
    pub(super) fn block(&self) -> usize {
        self.block
    }

    pub(super) fn lane(&self) -> usize {
        self.lane
    }

    /// Place in the lane.
    pub(super) fn place(&self) -> u32 {
        self.place
    }

    pub(super) fn listens(&self) -> bool {
        self.streams.iter().any(|s| !s.waits)
    }

    /// From now on; the first frame will say how its segment begins. What was before it may be missing: `gap`.
    pub(super) fn listen(&mut self, wire: Wire, head: Head, gap: bool) {
        // A number that no segment has: a replay sees that they do not follow each other.
        self.number += u64::from(gap && self.number > 0);
        self.changed = true;
        let (version, hash) = (head.version, head.hash.clone());
        let (gone, held) = (false, Vec::new());
        self.streams.push(Stream { wire, gone, held, head: Some(head), writer: None, waits: false, version, hash });
    }

    /// Hashes of the components that segments may still come of.
    pub(super) fn components(&self) -> impl Iterator<Item = &str> {
        self.streams.iter().map(|s| s.hash.as_str())
    }

    /// True when it is not known yet, and nobody was asked, whether the state of this version can be saved.
    pub(super) fn want_rehearsal(&mut self, version: u64) -> bool {
        if self.saves.iter().any(|(known, _)| *known == version) {
            return false;
        }
        // What has no stream any more does not come back under its number.
        let streams = &self.streams;
        self.saves.retain(|(known, _)| streams.iter().any(|s| s.version == *known));
        self.saves.push((version, None));
        true
    }

    pub(super) fn rehearsed(&mut self, version: u64, saves: bool) {
        let wanted = self.saves.iter_mut().filter(|(known, _)| *known == version);
        wanted.for_each(|(_, known)| *known = Some(saves));
    }

    /// Whether the state of this version can be saved; `None` as long as that is not known.
    pub(super) fn saves(&self, version: u64) -> Option<bool> {
        self.saves.iter().find(|(known, _)| *known == version).and_then(|(_, saves)| *saves)
    }

    /// Number of the version whose state is due: at most one is on its way, and none that nobody needs.
    pub(super) fn is_due(&self, now: u64) -> Option<u64> {
        if !self.changed || self.asked.is_some() || now < self.due {
            return None;
        }
        let begun = |s: &&Stream| !s.waits && (s.writer.is_some() || s.head.is_some());
        let mut streams = self.streams.iter().filter(begun);
        streams.find(|s| self.saves(s.version) == Some(true)).map(|s| s.version)
    }

    /// Since when the next state is due, or from when on, plant time, ns.
    pub(super) fn due(&self) -> u64 {
        self.due
    }

    pub(super) fn asked(&mut self, now: u64, keyframe: u64) {
        self.asked = Some(now);
        self.due = now.saturating_add(keyframe);
    }

    pub(super) fn waits_for_state(&self, now: u64, patience: u64) -> bool {
        self.asked.is_some_and(|asked| now.saturating_sub(asked) < patience)
    }

    /// What has happened so far as segments.
    pub(super) fn cut(&mut self) -> Vec<Segment> {
        let number = &mut self.number;
        self.streams.iter_mut().filter_map(|s| s.begin(Start::Continued, number)).collect()
    }

    /// The same, and it goes on as if nobody had looked.
    pub(super) fn so_far(&self) -> Vec<Segment> {
        let mut number = self.number;
        let cut = |s: &Stream| numbered(s.writer.clone()?.cut(Start::Continued), &mut number);
        self.streams.iter().filter_map(cut).collect()
    }

    /// Before the tape is read: which taps have told all they had to.
    pub(super) fn look(&mut self) {
        self.streams.iter_mut().for_each(|s| s.gone = s.wire.there.strong_count() == 0);
    }

    /// Takes a frame of one of its taps; a segment of `full` bytes is cut.
    pub(super) fn hear(&mut self, serial: u16, missed: u32, frame: Frame<'_>, now: u64, full: usize, turn: &mut Turn) {
        let Some(at) = self.streams.iter().position(|s| s.wire.serial == serial) else { return };
        match frame {
            Frame::Settings { cells, taken } if self.streams[at].waits => {
                self.streams[at].held.push(Held { missed, cells: cells.to_vec(), taken });
            }
            Frame::Ended => {
                self.missed(at, missed, now, turn);
                self.over(at, now, turn);
            }
            frame => {
                self.missed(at, missed, now, turn);
                self.event(at, frame, turn);
                let Self { streams, number, .. } = self;
                let Stream { head, writer, .. } = &mut streams[at];
                if writer.as_ref().is_some_and(|w| w.is_full(full)) {
                    turn.segments.extend(begin(head, writer, Start::Continued, number));
                }
            }
        }
    }

    /// After the tape was read: what is gone is over.
    pub(super) fn settle(&mut self, now: u64, turn: &mut Turn) {
        while let Some(at) = self.streams.iter().position(|s| s.gone && !s.waits) {
            self.over(at, now, turn);
        }
        // What another version has taken the place of for good.
        let before = self.streams.len();
        self.streams.retain(|s| !(s.gone && s.waits));
        turn.ended |= self.streams.len() < before;
    }

    /// A version is over; the one before it is back, if it waits.
    fn over(&mut self, at: usize, now: u64, turn: &mut Turn) {
        let mut ended = self.streams.remove(at);
        turn.segments.extend(ended.begin(Start::Continued, &mut self.number));
        (self.asked, turn.ended) = (None, true);
        if let Some(before) = at.checked_sub(1)
            && std::mem::take(&mut self.streams[before].waits)
        {
            for Held { missed, cells, taken } in std::mem::take(&mut self.streams[before].held) {
                self.missed(before, missed, now, turn);
                self.event(before, Frame::Settings { cells: &cells, taken }, turn);
            }
        }
    }

    fn missed(&mut self, at: usize, missed: u32, now: u64, turn: &mut Turn) {
        if missed > 0 {
            turn.missed += u64::from(missed);
            add(&mut self.streams[at].writer, Event::Missed(missed.into()));
            // A replay can go on from the next state.
            (self.due, self.asked, self.changed) = (now, None, true);
        }
    }

    fn event(&mut self, at: usize, frame: Frame<'_>, turn: &mut Turn) {
        let Self { streams, number, asked, changed, saves, .. } = self;
        let Stream { head, writer, waits, version, .. } = &mut streams[at];
        match frame {
            Frame::State { state: TapState::Cold, .. } => {
                (*asked, *changed) = (None, false);
                turn.segments.extend(begin(head, writer, Start::Cold, number));
            }
            Frame::State { state: TapState::Retained(cells), .. } => {
                (*asked, *changed) = (None, false);
                turn.segments.extend(begin(head, writer, Start::State(cells.to_vec()), number));
            }
            Frame::State { state: TapState::Absent, .. } => *asked = None,
            Frame::State { state: TapState::Unsaved, .. } => {
                *asked = None;
                // It has failed at it, or would have: it is not asked again.
                saves.iter_mut().filter(|(v, _)| v == version).for_each(|(_, saves)| *saves = Some(false));
            }
            Frame::Execution { scan, arguments, outputs, .. } => {
                turn.faulted |= outputs.is_err();
                *changed = true;
                add(writer, Event::Execution { scan, arguments, outputs });
            }
            Frame::Settings { cells, taken } => {
                turn.faulted |= taken.is_err();
                *changed = true;
                match head {
                    // Its first segment begins with them.
                    Some(head) if writer.is_none() && taken == Ok(true) => head.settings = cells.to_vec(),
                    _ => add(writer, Event::Settings { cells, taken }),
                }
            }
            Frame::Restarted if writer.is_none() => drop(begin(head, writer, Start::Cold, number)),
            Frame::Restarted => add(writer, Event::Restarted),
            Frame::Waits => {
                (*asked, *waits) = (None, true);
                turn.segments.extend(begin(head, writer, Start::Continued, number));
            }
            // Whoever hears of it ends the stream.
            Frame::Ended => {}
        }
    }
}

impl Stream {
    fn begin(&mut self, start: Start, number: &mut u64) -> Option<Segment> {
        begin(&mut self.head, &mut self.writer, start, number)
    }
}

/// Ends a segment, if anything has happened in it, and begins another one.
fn begin(head: &mut Option<Head>, writer: &mut Option<Writer>, start: Start, number: &mut u64) -> Option<Segment> {
    let Some(writer) = writer else {
        if start != Start::Continued
            && let Some(head) = head.take()
        {
            *writer = Some(Writer::new(Head { start, ..head }));
        }
        return None;
    };
    numbered(writer.cut(start), number)
}

/// Segments of all versions of a block are numbered in the order in which they happened.
fn numbered(segment: Option<Segment>, number: &mut u64) -> Option<Segment> {
    let mut segment = segment?;
    segment.head.number = *number;
    *number += 1;
    Some(segment)
}

fn add(writer: &mut Option<Writer>, event: Event<'_>) {
    if let Some(writer) = writer {
        writer.add(event);
    }
}
