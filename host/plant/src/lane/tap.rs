//! Taps: what a block gets and gives at each execution, copied into a bounded ring for whoever listens off the lane.
//!
//! The lane writes words, a frame at a time and whole or not at all; a frame that finds no room is counted, and the next one
//! that does says how many were missed. Nothing here allocates but [`tap`] itself.
//!
//! ```text
//! header: kind │ flags << 8 │ words behind it << 16 │ frames missed before it << 32
//! state:      time of the last execution, retained cells
//! execution:  now, elapsed, ns it took (0: not measured), argument cells, output cells (none after a fault)
//! settings:   setting cells
//! ```

use super::{Block, Lane, Report};
use latchwork_block::{Class, Fault, Instance, Scan};
use std::sync::Arc;

/// Who listens: a block has room for one of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum TapSlot {
    /// The flight recorder.
    Recorder = 0,
    /// The shadow of a swap.
    Shadow = 1,
}

/// A clock for the length of executions, ns.
pub type Timer = Arc<dyn Fn() -> u64 + Send + Sync>;

const STATE: u64 = 1;
const EXECUTION: u64 = 2;
const SETTINGS: u64 = 3;
const RESTARTED: u64 = 4;
const ENDED: u64 = 5;

const FIRST: u64 = 1 << 8;
const FAULTED: u64 = 1 << 9;
/// The block has not executed yet with its instance: what it starts with is its state.
const COLD: u64 = 1 << 10;
/// The block is out of order.
const ABSENT: u64 = 1 << 11;
const REFUSED: u64 = 1 << 12;

const LENGTH: u32 = 16;
const MISSED: u32 = 32;
/// Words of an execution before its cells: header, now, elapsed, ns it took.
const HEAD: usize = 4;
/// Reports that one request may lead to; none is taken while there is no room for them.
pub(super) const REPORTS: usize = 2;

/// The lane's end of a tap.
pub struct Tap {
    to: rtrb::Producer<u64>,
    /// The frame in the making, as long as the longest.
    frame: Box<[u64]>,
    missed: u32,
    ended: bool,
    timer: Option<Timer>,
}

/// The taps of a block, by [`TapSlot`].
#[derive(Default)]
pub struct Taps([Option<Box<Tap>>; 2]);

/// A new tap of a block of a class with room for `frames` executions. With a timer each execution is timed: that costs two
/// looks at the clock.
pub fn tap(class: &Class, frames: usize, timer: Option<Timer>) -> (Box<Tap>, TapReader) {
    let (arguments, outputs) = (class.argument_cells(), class.output_cells());
    let longest = (HEAD + arguments + outputs).max(2 + class.retained.len()).max(1 + class.settings.len());
    let (to, from) = rtrb::RingBuffer::new(longest * frames.max(2));
    let tap = Tap { to, frame: vec![0; longest].into(), missed: 0, ended: false, timer };
    (Box::new(tap), TapReader { from, buffer: vec![0; longest], arguments })
}

impl Tap {
    fn send(&mut self, kind: u64, flags: u64, words: usize) {
        if self.ended {
            return;
        }
        let length = (words as u64 - 1) << LENGTH;
        self.frame[0] = kind | flags | length | u64::from(self.missed) << MISSED;
        match self.to.push_entire_slice(&self.frame[..words]) {
            Ok(()) => self.missed = 0,
            Err(_) => self.missed = self.missed.saturating_add(1),
        }
    }

    fn cells(&mut self, at: usize, cells: &[u64]) -> usize {
        self.frame[at..at + cells.len()].copy_from_slice(cells);
        at + cells.len()
    }

    /// The first half of an execution: arguments, which the outputs may overwrite.
    fn before(&mut self, ins: &[u32], cells: &[u64]) {
        for (word, cell) in self.frame[HEAD..].iter_mut().zip(ins) {
            *word = cells[*cell as usize];
        }
    }

    fn after(&mut self, scan: Scan, took: u64, arguments: usize, outputs: Option<&[u64]>) {
        self.frame[1..HEAD].copy_from_slice(&[scan.now, scan.elapsed, took]);
        let end = self.cells(HEAD + arguments, outputs.unwrap_or(&[]));
        let flags = if scan.first { FIRST } else { 0 } | if outputs.is_none() { FAULTED } else { 0 };
        self.send(EXECUTION, flags, end);
    }

    /// No further frame; the reader hears of it as soon as there is room.
    fn end(&mut self) {
        self.send(ENDED, 0, 1);
        self.ended = true;
    }
}

impl Taps {
    fn each(&mut self) -> impl Iterator<Item = &mut Tap> {
        self.0.iter_mut().flatten().map(|tap| &mut **tap)
    }

    fn any(&self) -> bool {
        self.0.iter().flatten().any(|tap| !tap.ended)
    }

    /// Executes a block under its taps.
    pub(super) fn execute(
        &mut self,
        instance: &mut Instance,
        scan: Scan,
        ins: &[u32],
        out: u32,
        cells: &mut [u64],
    ) -> Result<(), Fault> {
        self.each().for_each(|tap| tap.before(ins, cells));
        let timer = self.each().find_map(|tap| tap.timer.clone());
        let begun = timer.as_ref().map(|now| now());
        let result = instance.execute(scan, ins, out, cells);
        let took = timer.zip(begun).map_or(0, |(now, begun)| now().saturating_sub(begun));
        let outputs = out as usize..out as usize + instance.class().output_cells();
        for tap in self.each() {
            tap.after(scan, took, ins.len(), result.is_ok().then(|| &cells[outputs.clone()]));
        }
        result
    }

    /// The block got settings: `None` when it faulted over them.
    pub(super) fn settings(&mut self, cells: &[u64], taken: Option<bool>) {
        let flags = match taken {
            Some(true) => 0,
            Some(false) => REFUSED,
            None => FAULTED,
        };
        for tap in self.each() {
            let end = tap.cells(1, cells);
            tap.send(SETTINGS, flags, end);
        }
    }

    /// The block has a fresh instance, cold.
    pub(super) fn restarted(&mut self) {
        self.each().for_each(|tap| tap.send(RESTARTED, 0, 1));
    }
}

impl Lane {
    /// Puts a tap on a block; its first frame is the block's state.
    #[cold]
    pub(super) fn tap(&mut self, index: usize, slot: TapSlot, tap: Box<Tap>, now: u64) {
        self.untap(index, slot);
        let Some(block) = self.parts.blocks.get_mut(index) else { return };
        match &mut block.rest.taps.0[slot as usize] {
            free @ None => *free = Some(tap),
            // The old one did not get away: the reader of the new one sees that it was abandoned.
            Some(_) => drop(self.parts.reports.push(Report::Tap(tap))),
        }
        block.tapped = block.rest.taps.any();
        self.keyframe(index, slot, now);
    }

    /// Ends a tap and sends it back.
    #[cold]
    pub(super) fn untap(&mut self, index: usize, slot: TapSlot) {
        let Some(block) = self.parts.blocks.get_mut(index) else { return };
        let place = &mut block.rest.taps.0[slot as usize];
        if let Some(mut tap) = place.take() {
            if !tap.ended {
                tap.end();
            }
            // Without room it stays where it is, and says nothing any more: nothing is freed here.
            if let Err(rtrb::PushError::Full(Report::Tap(tap))) = self.parts.reports.push(Report::Tap(tap)) {
                *place = Some(tap);
            }
        }
        block.tapped = block.rest.taps.any();
    }

    /// Ends all taps of a block, because it becomes another version: whoever wants to go on listening taps that one.
    pub(super) fn end_taps(&mut self, index: usize) {
        self.untap(index, TapSlot::Recorder);
        self.untap(index, TapSlot::Shadow);
    }

    /// Sends a tap the state that the block has now.
    #[cold]
    pub(super) fn keyframe(&mut self, index: usize, slot: TapSlot, now: u64) {
        let Some(block) = self.parts.blocks.get_mut(index) else { return };
        let Block { instance, last, first, ran, rest, .. } = block;
        let Some(tap) = &mut rest.taps.0[slot as usize] else { return };
        tap.frame[1] = *last;
        let Some(instance) = instance else { return tap.send(STATE, ABSENT, 2) };
        if *first && !*ran {
            return tap.send(STATE, COLD, 2);
        }
        let end = 2 + instance.class().retained.len();
        let fault = match instance.save_into(&mut tap.frame[2..end]) {
            Ok(true) => return tap.send(STATE, 0, end),
            Ok(false) => return tap.send(STATE, 0, 2),
            Err(fault) => fault,
        };
        tap.send(STATE, ABSENT, 2);
        self.block_fault(index, now, &fault);
    }
}

/// The listener's end of a tap.
pub struct TapReader {
    from: rtrb::Consumer<u64>,
    buffer: Vec<u64>,
    arguments: usize,
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
        /// Output cells in the order of the class, before forces; `None` when the block faulted.
        outputs: Option<&'a [u64]>,
    },
    /// It got new settings; what it said.
    Settings {
        /// One cell per setting.
        cells: &'a [u64],
        /// It took them, refused them, or (`None`) faulted over them.
        taken: Option<bool>,
    },
    /// It has a fresh instance with the settings it last took: a cold start.
    Restarted,
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
}

impl TapReader {
    /// The next frame and the number of frames missed before it; `None` when there is none yet.
    pub fn next(&mut self) -> Option<(u32, Frame<'_>)> {
        let header = *self.from.peek().ok()?;
        let words = (header >> LENGTH & 0xffff) as usize;
        // Frames are written whole: what the header announces is there.
        self.from.pop_entire_slice(self.buffer.get_mut(..=words)?).ok()?;
        let words = &self.buffer[1..=words];
        let flag = |flag| header & flag != 0;
        let frame = match header & 0xff {
            STATE => Frame::State {
                last: words[0],
                state: match (flag(ABSENT), flag(COLD)) {
                    (true, _) => State::Absent,
                    (_, true) => State::Cold,
                    _ => State::Retained(&words[1..]),
                },
            },
            EXECUTION => {
                let (arguments, outputs) = words[HEAD - 1..].split_at(self.arguments);
                Frame::Execution {
                    scan: Scan { now: words[0], elapsed: words[1], first: flag(FIRST) },
                    took: words[2],
                    arguments,
                    outputs: (!flag(FAULTED)).then_some(outputs),
                }
            }
            SETTINGS => Frame::Settings { cells: words, taken: (!flag(FAULTED)).then_some(!flag(REFUSED)) },
            RESTARTED => Frame::Restarted,
            _ => Frame::Ended,
        };
        Some(((header >> MISSED) as u32, frame))
    }

    /// Nothing is there, and nothing will come.
    pub fn is_over(&self) -> bool {
        self.from.is_abandoned() && self.from.is_empty()
    }
}

impl std::fmt::Debug for Tap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tap").field("missed", &self.missed).field("ended", &self.ended).finish_non_exhaustive()
    }
}
