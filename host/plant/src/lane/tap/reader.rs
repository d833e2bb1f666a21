//! The other end of a tap: words become frames again.

use super::{
    ABSENT, COLD, EXECUTION, FAULTED, FIRST, HEAD, HEADER, KIND, LENGTH, MISSED, REFUSED, RESTARTED, SETTINGS, SKIP,
    STATE, WAITS,
};
use latchwork_block::{FaultKind, Scan};

/// The listener's end of a tap, or of a tape.
pub struct TapReader {
    from: rtrb::Consumer<u64>,
    /// Frames are multiples of so many words.
    unit: usize,
    buffer: Vec<u64>,
}

/// What a tap has to tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Frame<'a> {
    /// The block's state, before its next execution.
    State {
        /// Plant time of its last execution, ns.
        last: u64,
        /// The state.
        state: State<'a>,
    },
    /// An execution.
    Execution {
        /// Its time.
        scan: Scan,
        /// How long it took, ns; 0 when it was not measured.
        took: u64,
        /// Argument cells in the order of the class.
        arguments: &'a [u64],
        /// Output cells in the order of the class, before forces; or how the block faulted.
        outputs: Result<&'a [u64], FaultKind>,
    },
    /// It got new settings; what it said.
    Settings {
        /// One cell per setting.
        cells: &'a [u64],
        /// It took them or refused them, or how it faulted over them.
        taken: Result<bool, FaultKind>,
    },
    /// It has a fresh instance with the settings it last took: a cold start.
    Restarted,
    /// Another version executes from now on. This one may come back, until the tap is gone.
    Waits,
    /// It is not tapped any more.
    Ended,
}

/// State of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State<'a> {
    /// It has a fresh instance that has not executed yet.
    Cold,
    /// What it retains, one cell per port; nothing for a class that retains nothing.
    Retained(&'a [u64]),
    /// It is out of order.
    Absent,
    /// It cannot be saved.
    Unsaved,
}

impl TapReader {
    pub(super) fn new(from: rtrb::Consumer<u64>, unit: usize) -> Self {
        Self { from, unit, buffer: Vec::new() }
    }

    /// Words that are there now.
    pub fn waiting(&self) -> usize {
        self.from.slots()
    }

    /// The next frame and the number of frames missed before it; `None` when there is none yet.
    pub fn next_frame(&mut self) -> Option<(u32, Frame<'_>)> {
        let mut all = usize::MAX;
        self.next_of_all(&mut all).map(|(_, missed, frame)| (missed, frame))
    }

    /// The same of a tape, and before it the number of the tap; the words it took are taken off `left`.
    pub fn next_of_all(&mut self, left: &mut usize) -> Option<(u32, u32, Frame<'_>)> {
        let header = loop {
            let header = *self.from.peek().ok()?;
            let words = (header >> LENGTH & 0xffff) as usize + 1;
            self.buffer.resize(words.next_multiple_of(self.unit), 0);
            // Frames are written whole: what the header announces is there.
            self.from.pop_entire_slice(&mut self.buffer).ok()?;
            *left = left.saturating_sub(self.buffer.len());
            self.buffer.truncate(words);
            if header & 0xff != SKIP {
                break header;
            }
        };
        let who = *self.buffer.get(1)?;
        let words = self.buffer.get(HEADER..)?;
        let flag = |flag| header & flag != 0;
        let fault = flag(FAULTED).then(|| FaultKind::from_code((header >> KIND & 7) as u8).unwrap_or(FaultKind::Trap));
        let frame = match header & 0xff {
            STATE => Frame::State {
                last: words[0],
                state: match (flag(ABSENT), flag(COLD)) {
                    (true, _) if flag(FAULTED) => State::Unsaved,
                    (true, _) => State::Absent,
                    (_, true) => State::Cold,
                    _ => State::Retained(&words[1..]),
                },
            },
            EXECUTION => {
                let (arguments, outputs) = words[HEAD - HEADER..].split_at_checked((who >> 32) as usize)?;
                Frame::Execution {
                    scan: Scan { now: words[0], elapsed: words[1], first: flag(FIRST) },
                    took: words[2],
                    arguments,
                    outputs: fault.map_or(Ok(outputs), Err),
                }
            }
            SETTINGS => Frame::Settings { cells: words, taken: fault.map_or(Ok(!flag(REFUSED)), Err) },
            RESTARTED => Frame::Restarted,
            WAITS => Frame::Waits,
            _ => Frame::Ended,
        };
        Some((who as u32, (header >> MISSED) as u32, frame))
    }

    /// Nothing more will come than what is there.
    pub fn is_abandoned(&self) -> bool {
        self.from.is_abandoned()
    }

    /// Nothing is there, and nothing will come.
    pub fn is_over(&self) -> bool {
        self.from.is_abandoned() && self.from.is_empty()
    }
}
