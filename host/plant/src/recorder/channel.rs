//! One block: from the frames of its tap to segments.

use crate::lane::{Frame, TapReader, TapState};
use latchwork_testbed::replay::{Event, Head, Segment, Start, Writer};

/// One recorded block.
pub(super) struct Channel {
    block: usize,
    lane: usize,
    place: u32,
    reader: Option<TapReader>,
    /// Where the next segment stands, until a state has come.
    head: Option<Head>,
    writer: Option<Writer>,
    /// Number of its next segment.
    number: u64,
    /// When its next state is due, plant time, ns.
    due: u64,
    /// When a state was asked for that has not come.
    asked: Option<u64>,
}

/// What a turn has brought.
#[derive(Default)]
pub(super) struct Turn {
    pub(super) segments: Vec<Segment>,
    pub(super) missed: u64,
    pub(super) faulted: bool,
}

impl Channel {
    pub(super) fn new(block: usize, lane: usize, place: u32, due: u64) -> Self {
        Self { block, lane, place, reader: None, head: None, writer: None, number: 0, due, asked: None }
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
        self.reader.is_some()
    }

    /// From now on; the first frame will say how its segment begins.
    pub(super) fn listen(&mut self, reader: TapReader, head: Head) {
        self.reader = Some(reader);
        self.head = Some(head);
    }

    /// Bytes that are in no segment yet.
    pub(super) fn open_bytes(&self) -> usize {
        self.writer.as_ref().map_or(0, Writer::len)
    }

    pub(super) fn is_due(&self, now: u64) -> bool {
        self.writer.is_some() && now >= self.due
    }

    pub(super) fn asked(&mut self, now: u64, keyframe: u64) {
        self.asked = Some(now);
        self.due = now.saturating_add(keyframe);
    }

    pub(super) fn waits_for_state(&self, now: u64, patience: u64) -> bool {
        self.asked.is_some_and(|asked| now.saturating_sub(asked) < patience)
    }

    /// What has happened so far as a segment.
    pub(super) fn cut(&mut self) -> Option<Segment> {
        self.begin(Start::Continued)
    }

    fn begin(&mut self, start: Start) -> Option<Segment> {
        let Some(writer) = &mut self.writer else {
            if start != Start::Continued
                && let Some(head) = self.head.take()
            {
                self.writer = Some(Writer::new(Head { start, number: self.number, ..head }));
            }
            return None;
        };
        let segment = writer.cut(start);
        if let Some(segment) = &segment {
            self.number = segment.head.number + 1;
        }
        segment
    }

    /// Takes what the tap has brought; a segment of `full` bytes is cut.
    pub(super) fn turn(&mut self, now: u64, full: usize) -> Turn {
        let mut turn = Turn::default();
        let Some(mut reader) = self.reader.take() else { return turn };
        let mut ended = false;
        while let Some((missed, frame)) = reader.next() {
            if missed > 0 {
                turn.missed += u64::from(missed);
                self.add(Event::Missed(missed.into()));
                // A replay can go on from the next state.
                (self.due, self.asked) = (now, None);
            }
            match frame {
                Frame::State { state: TapState::Cold, .. } => turn.segments.extend(self.begin(Start::Cold)),
                Frame::State { state: TapState::Retained(cells), .. } => {
                    self.asked = None;
                    turn.segments.extend(self.begin(Start::State(cells.to_vec())));
                }
                Frame::State { state: TapState::Absent, .. } => self.asked = None,
                Frame::Execution { scan, arguments, outputs, .. } => {
                    turn.faulted |= outputs.is_none();
                    self.add(Event::Execution { scan, arguments, outputs });
                }
                Frame::Settings { cells, taken } => {
                    turn.faulted |= taken.is_none();
                    self.add(Event::Settings { cells, taken });
                }
                Frame::Restarted if self.writer.is_none() => drop(self.begin(Start::Cold)),
                Frame::Restarted => self.add(Event::Restarted),
                Frame::Ended => ended = true,
            }
            if self.open_bytes() >= full {
                turn.segments.extend(self.cut());
            }
        }
        if ended || reader.is_over() {
            turn.segments.extend(self.cut());
            (self.writer, self.head, self.asked) = (None, None, None);
        } else {
            self.reader = Some(reader);
        }
        turn
    }

    fn add(&mut self, event: Event<'_>) {
        if let Some(writer) = &mut self.writer {
            writer.add(event);
        }
    }
}
