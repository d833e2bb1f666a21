//! Taps: what a block gets and gives at each execution, copied into a bounded ring for whoever listens off the lane.
//!
//! The lane writes words, a frame at a time and whole or not at all; a frame that finds no room is counted, and the next one
//! that does says how many were missed. Settings that a block took are not missed: they wait for room before everything
//! else. Nothing here allocates but [`tap`], [`on_tape`] and [`tape`].
//!
//! The taps of the flight recorder share one ring per lane, its [`Tape`]: what the blocks of a lane tell in a scan stands side by
//! side, which costs the lane less than a ring for each. A shadow has its own.
//!
//! ```text
//! header: kind │ flags << 8 │ words behind it << 16 │ frames missed before it << 32
//!         number of the tap │ argument cells of its block << 32
//! state:      time of the last execution, retained cells
//! execution:  now, elapsed, ns it took (0: not measured), argument cells, output cells (none after a fault)
//! settings:   setting cells
//! ```
//!
//! A tap that is put on a block at work tells no execution before its state, which is saved in the lane's spare time
//! ([`super::save`]).

mod reader;
mod ring;

pub use reader::{Frame, State, TapReader};
pub use ring::{Tape, tape};

use super::{Block, Lane, Report};
use latchwork_block::{Class, Fault, FaultKind, Instance, Scan};
use ring::{Ring, Slot};
use std::sync::{Arc, Weak};

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
const WAITS: u64 = 6;
/// The rest of the ring is empty.
const SKIP: u64 = 7;

const FIRST: u64 = 1 << 8;
const FAULTED: u64 = 1 << 9;
/// The block has not executed yet with its instance: what it starts with is its state.
const COLD: u64 = 1 << 10;
/// The block is out of order.
const ABSENT: u64 = 1 << 11;
const REFUSED: u64 = 1 << 12;

/// Three bits: the kind of a fault.
const KIND: u32 = 13;
const LENGTH: u32 = 16;
const MISSED: u32 = 32;
/// Time for which executions may be on their way, ns: a listener comes a hundred times a second.
const ROOM: u64 = 250_000_000;
/// Executions that may be, at least and at most. Little room stays in the processor's caches: a large one costs the lane more.
const EXECUTIONS: (u64, u64) = (64, 512);
/// Words that every frame begins with.
const HEADER: usize = 2;
/// Words of an execution before its cells: header, now, elapsed, ns it took.
const HEAD: usize = HEADER + 3;
/// Reports that one request may lead to; none is taken while there is no room for them.
pub(super) const REPORTS: usize = 2;

/// The lane's end of a tap.
// In this order: what every execution touches comes first.
#[repr(C)]
pub struct Tap {
    /// Words of an execution without faults.
    slot: u32,
    missed: u32,
    /// Second word of its frames.
    who: u64,
    ended: bool,
    /// The state came with which what it tells begins.
    live: bool,
    settings_wait: bool,
    /// `None`: it tells what it has to tell on its lane's tape.
    own: Option<Ring>,
    timer: Option<Timer>,
    /// Header and cells of settings that the block took, while they wait for room.
    settings: Box<[u64]>,
    /// Another frame in the making, as long as the longest.
    frame: Box<[u64]>,
    /// It is for this version of the block alone.
    version: Option<u64>,
    /// The block may be asked for its state.
    saves: bool,
    /// Argument and output cells of the class it was made for.
    shape: (usize, usize),
    /// Gone with the tap: whoever reads the tape sees that nothing more will come.
    _there: Arc<()>,
}

/// The taps of a block, by [`TapSlot`].
#[derive(Default)]
pub struct Taps([Option<Box<Tap>>; 2]);

/// Executions that a tap needs room for, of a block in a lane of this period, ns; 0: edges come, nobody knows when.
pub fn room(every: u64) -> usize {
    let executions = ROOM.checked_div(every).unwrap_or(u64::MAX);
    executions.clamp(EXECUTIONS.0, EXECUTIONS.1) as usize
}

/// Words of an execution of a block of a class, in a tap's ring or on a tape.
pub fn words(class: &Class) -> usize {
    HEAD + class.argument_cells() + class.output_cells()
}

/// A new tap of a block of a class, with a ring for `frames` executions. With a timer each execution is timed: that costs two
/// looks at the clock.
pub fn tap(class: &Class, frames: usize, timer: Option<Timer>) -> (Box<Tap>, TapReader) {
    let mut tap = Tap::new(class, 0);
    let (ring, reader) = ring::own(words(class), frames.max(2), tap.frame.len().max(tap.settings.len()));
    (tap.own, tap.timer) = (Some(ring), timer);
    (tap, reader)
}

/// A new tap of a block of a class, which tells everything on the tape of the block's lane, under a number. The other one is
/// dead when nothing more will come.
pub fn on_tape(class: &Class, number: u32) -> (Box<Tap>, Weak<()>) {
    let tap = Tap::new(class, number);
    let there = Arc::downgrade(&tap._there);
    (tap, there)
}

impl Tap {
    fn new(class: &Class, number: u32) -> Box<Self> {
        let (arguments, outputs) = (class.argument_cells(), class.output_cells());
        Box::new(Self {
            slot: words(class) as u32,
            missed: 0,
            who: u64::from(number) | (arguments as u64) << 32,
            ended: false,
            live: false,
            settings_wait: false,
            own: None,
            timer: None,
            settings: vec![0; HEADER + class.settings.len()].into(),
            frame: vec![0; HEADER + 1 + class.retained.len().max(class.settings.len())].into(),
            version: None,
            saves: true,
            shape: (arguments, outputs),
            _there: Arc::new(()),
        })
    }

    /// For this version of the block alone ([`crate::supervisor::Recipe::version`]): with another one it ends at once.
    pub fn only(&mut self, version: u64) {
        self.version = Some(version);
    }

    /// The block is not asked for its state: it would fail.
    pub fn without_states(&mut self) {
        self.saves = false;
    }

    /// The state that a block has now; `None` when it is cold.
    pub(super) fn state(&mut self, last: u64, state: Option<&[u64]>, tape: &mut Tape) {
        self.frame[HEADER] = last;
        let end = self.cells(HEADER + 1, state.unwrap_or(&[]));
        self.begin(if state.is_none() { COLD } else { 0 }, end, tape);
    }

    /// Sends a state in the making, with which what it tells begins.
    fn begin(&mut self, flags: u64, words: usize, tape: &mut Tape) {
        self.live |= self.send(STATE, flags, words, tape);
    }

    /// The block executes another version from now on; this one may come back.
    pub(super) fn waits(&mut self, tape: &mut Tape) {
        self.send(WAITS, 0, HEADER, tape);
    }

    /// The block got settings, and took them or not, or faulted over them.
    pub(super) fn settings(&mut self, cells: &[u64], taken: Result<bool, FaultKind>, tape: &mut Tape) {
        let flags = match taken {
            // What comes after them means nothing without them.
            Ok(true) if cells.len() + HEADER == self.settings.len() => {
                self.missed = self.missed.saturating_add(u32::from(self.settings_wait));
                self.settings[HEADER..].copy_from_slice(cells);
                self.settings_wait = true;
                self.send_settings(tape);
                return;
            }
            Ok(true) => 0,
            Ok(false) => REFUSED,
            Err(kind) => fault_flags(kind),
        };
        let end = self.cells(HEADER, cells);
        self.send(SETTINGS, flags, end, tape);
    }

    /// Sends settings that wait; false when they still do.
    fn send_settings(&mut self, tape: &mut Tape) -> bool {
        if !self.settings_wait {
            return true;
        }
        let length = (self.settings.len() as u64 - 1) << LENGTH;
        self.settings[0] = SETTINGS | length | u64::from(self.missed) << MISSED;
        self.settings[1] = self.who;
        let ring = self.own.as_mut().or(tape.0.as_mut()).filter(|_| !self.ended);
        let sent = ring.is_some_and(|ring| ring.push(&self.settings));
        if sent {
            (self.missed, self.settings_wait) = (0, false);
        }
        sent
    }

    /// True when it found room.
    fn send(&mut self, kind: u64, flags: u64, words: usize, tape: &mut Tape) -> bool {
        if self.ended {
            return false;
        }
        let ready = self.send_settings(tape);
        let length = (words as u64 - 1) << LENGTH;
        self.frame[0] = kind | flags | length | u64::from(self.missed) << MISSED;
        self.frame[1] = self.who;
        let ring = self.own.as_mut().or(tape.0.as_mut()).filter(|_| ready);
        let sent = ring.is_some_and(|ring| ring.push(&self.frame[..words]));
        self.missed = if sent { 0 } else { self.missed.saturating_add(1) };
        sent
    }

    fn cells(&mut self, at: usize, cells: &[u64]) -> usize {
        self.frame[at..at + cells.len()].copy_from_slice(cells);
        at + cells.len()
    }

    /// The place for an execution, with its arguments, which the outputs may overwrite; none without room.
    #[inline]
    fn open<'a>(&'a mut self, ins: &[u32], cells: &[u64], tape: Option<&'a mut Tape>) -> Option<Slot<'a>> {
        let Self { own, slot, missed, who, settings_wait, .. } = self;
        let ring = own.as_mut().or(tape.and_then(|tape| tape.0.as_mut())).filter(|_| !*settings_wait);
        let Some(mut slot) = ring.and_then(|ring| ring.open(*slot as usize)) else {
            *missed = missed.saturating_add(1);
            return None;
        };
        slot.begin(u64::from(std::mem::take(missed)) << MISSED, *who, ins, cells);
        Some(slot)
    }

    /// No further frame; the reader hears of it as soon as there is room.
    pub(super) fn end(&mut self, tape: &mut Tape) {
        self.send(ENDED, 0, HEADER, tape);
        self.ended = true;
    }
}

fn fault_flags(kind: FaultKind) -> u64 {
    FAULTED | u64::from(kind.code()) << KIND
}

impl Taps {
    /// Those that listen: one that has ended may be of another version, with frames that are too short for this one.
    fn each(&mut self) -> impl Iterator<Item = &mut Tap> {
        self.0.iter_mut().flatten().map(|tap| &mut **tap).filter(|tap| !tap.ended)
    }

    pub(super) fn any(&self) -> bool {
        self.0.iter().flatten().any(|tap| !tap.ended)
    }

    /// Executes a block under its taps.
    pub(super) fn execute(
        &mut self,
        tape: &mut Tape,
        instance: &mut Instance,
        scan: Scan,
        ins: &[u32],
        out: u32,
        cells: &mut [u64],
    ) -> Result<(), Fault> {
        let [recorder, shadow] = &mut self.0;
        let live = |tap: &&mut Box<Tap>| tap.live && !tap.ended;
        let (recorder, shadow) = (recorder.as_mut().filter(live), shadow.as_mut().filter(live));
        let timer = shadow.as_ref().and_then(|tap| tap.timer.clone());
        let recorder = recorder.and_then(|tap| {
            if tap.settings_wait {
                tap.send_settings(tape);
            }
            tap.open(ins, cells, Some(tape))
        });
        // It has a ring of its own.
        let shadow = shadow.and_then(|tap| {
            tap.send_settings(&mut Tape::default());
            tap.open(ins, cells, None)
        });
        let begun = timer.as_ref().map(|now| now());
        let result = instance.execute(scan, ins, out, cells);
        let took = timer.zip(begun).map_or(0, |(now, begun)| now().saturating_sub(begun));
        let outputs = result.as_ref().map(|()| &cells[out as usize..]).map_err(|fault| fault.kind);
        if let Some(slot) = recorder {
            slot.close(scan, took, outputs);
        }
        if let Some(slot) = shadow {
            slot.close(scan, took, outputs);
        }
        result
    }

    /// The block got settings, and took them or not, or faulted over them.
    pub(super) fn settings(&mut self, cells: &[u64], taken: Result<bool, FaultKind>, tape: &mut Tape) {
        self.each().for_each(|tap| tap.settings(cells, taken, tape));
    }

    /// The recorder's tap goes with the version that it was put on, and another one comes.
    pub(super) fn exchange(&mut self, other: &mut Option<Box<Tap>>) {
        std::mem::swap(&mut self.0[TapSlot::Recorder as usize], other);
    }

    /// The recorder's tap.
    pub(super) fn recorder(&mut self) -> Option<&mut Tap> {
        self.0[TapSlot::Recorder as usize].as_deref_mut()
    }

    /// The block has a fresh instance, cold.
    pub(super) fn restarted(&mut self, tape: &mut Tape) {
        self.each().for_each(|tap| tap.live |= tap.send(RESTARTED, 0, HEADER, tape));
    }
}

impl Lane {
    /// Before the first scan: what taps without a ring of their own tell stands on this tape.
    pub fn record_on(&mut self, tape: Tape) {
        self.parts.tape = tape;
    }

    /// Before the first scan: puts a tap on a block.
    pub(crate) fn tap_at_start(&mut self, index: usize, slot: TapSlot, tap: Box<Tap>) {
        self.tap(index, slot, tap, 0);
    }

    /// Puts a tap on a block; what it tells begins with the block's state.
    #[cold]
    pub(super) fn tap(&mut self, index: usize, slot: TapSlot, tap: Box<Tap>, now: u64) {
        self.untap(index, slot);
        let Some(block) = self.parts.blocks.get_mut(index) else { return };
        let mut tap = tap;
        let shape = |i: &Instance| (i.class().argument_cells(), i.class().output_cells());
        let other = block.instance.as_ref().is_some_and(|i| shape(i) != tap.shape);
        if other || tap.version.is_some_and(|version| version != block.rest.version) {
            tap.end(&mut self.parts.tape);
            return self.send(Report::Tap(tap));
        }
        match &mut block.taps.0[slot as usize] {
            free @ None => *free = Some(tap),
            // The old one did not get away: the reader of the new one sees that it was abandoned.
            Some(_) => drop(self.parts.reports.push(Report::Tap(tap))),
        }
        block.tapped = block.taps.any();
        self.keyframe(index, slot, now);
    }

    /// Ends a tap and sends it back.
    #[cold]
    pub(super) fn untap(&mut self, index: usize, slot: TapSlot) {
        let Some(block) = self.parts.blocks.get_mut(index) else { return };
        let place = &mut block.taps.0[slot as usize];
        if let Some(mut tap) = place.take() {
            if !tap.ended {
                tap.end(&mut self.parts.tape);
            }
            // Without room it stays where it is, and says nothing any more: nothing is freed here.
            if let Err(rtrb::PushError::Full(Report::Tap(tap))) = self.parts.reports.push(Report::Tap(tap)) {
                *place = Some(tap);
            }
        }
        block.tapped = block.taps.any();
    }

    /// Sends a tap the state that the block has now: at once if nothing has to be saved for it, else when there is time.
    #[cold]
    pub(super) fn keyframe(&mut self, index: usize, slot: TapSlot, now: u64) {
        let Some(block) = self.parts.blocks.get_mut(index) else { return };
        if block.saves_for(slot) {
            self.want_keyframe(index as u32, slot, now);
        } else {
            block.show(slot, &mut self.parts.tape);
        }
    }
}

impl Block {
    /// A state for this tap has to be saved.
    pub(super) fn saves_for(&self, slot: TapSlot) -> bool {
        let tap = self.taps.0[slot as usize].as_ref().filter(|tap| !tap.ended);
        let retains = self.instance.as_ref().is_some_and(|i| !i.class().retained.is_empty());
        tap.is_some_and(|tap| tap.saves) && retains && (self.ran || !self.first)
    }

    /// Sends a tap what is known of the state without saving it.
    fn show(&mut self, slot: TapSlot, tape: &mut Tape) {
        let Self { instance, last, first, ran, taps, .. } = self;
        let Some(tap) = taps.0[slot as usize].as_mut().filter(|tap| !tap.ended) else { return };
        let end = HEADER + 1;
        tap.frame[HEADER] = *last;
        match instance {
            None => drop(tap.send(STATE, ABSENT, end, tape)),
            Some(_) if *first && !*ran => tap.begin(COLD, end, tape),
            Some(instance) if instance.class().retained.is_empty() => tap.begin(0, end, tape),
            Some(_) => drop(tap.send(STATE, ABSENT | FAULTED, end, tape)),
        }
    }

    /// Saves the state for a tap and sends it.
    pub(super) fn save_for(&mut self, slot: TapSlot, tape: &mut Tape) -> Result<(), Fault> {
        if !self.saves_for(slot) {
            self.show(slot, tape);
            return Ok(());
        }
        let (Some(instance), Some(tap)) = (&mut self.instance, &mut self.taps.0[slot as usize]) else {
            return Ok(());
        };
        tap.frame[HEADER] = self.last;
        let begin = HEADER + 1;
        let end = begin + instance.class().retained.len();
        match instance.save_into(&mut tap.frame[begin..end]) {
            Ok(_) => tap.begin(0, end, tape),
            Err(fault) => {
                tap.send(STATE, ABSENT | FAULTED, begin, tape);
                return Err(fault);
            }
        }
        Ok(())
    }
}

impl std::fmt::Debug for Tap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tap").field("missed", &self.missed).field("ended", &self.ended).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use latchwork_block::Port;
    use latchwork_image::Type;

    #[test]
    fn a_tap_that_has_ended_is_not_written_to_by_a_longer_version() {
        let (mut ended, _) = tap(&Class::default(), 2, None);
        let tape = &mut Tape::default();
        ended.end(tape);
        let mut taps = Taps([Some(ended), None]);
        taps.settings(&[0; 100], Ok(true), tape);
        assert!(!taps.any());
    }

    #[test]
    fn settings_that_find_no_room_come_before_everything_else() {
        let setting = |name: &str| Port { path: name.into(), ty: Type::U32, signal: false, doc: None };
        let mut class = Class::default();
        class.settings = vec![setting("a"), setting("b")];
        let (mut tap, mut reader) = tap(&class, 2, None);
        let scan = |now| Scan { now, elapsed: 0, first: false };
        let none = &mut Tape::default();
        let execute = |tap: &mut Tap, now| {
            tap.open(&[], &[], None).into_iter().for_each(|slot| slot.close(scan(now), 0, Ok(&[])))
        };
        // Two executions are all there is room for.
        (0..3).for_each(|now| execute(&mut tap, now));
        tap.settings(&[1, 2], Ok(true), none);
        tap.settings(&[3, 4], Ok(true), none);
        tap.settings(&[5, 6], Ok(false), none);
        let mut told = Vec::new();
        while let Some((missed, frame)) = reader.next_frame() {
            told.push(format!("{missed} {frame:?}"));
        }
        tap.send_settings(none);
        execute(&mut tap, 9);
        while let Some((missed, frame)) = reader.next_frame() {
            told.push(format!("{missed} {frame:?}"));
        }
        assert_eq!(told.len(), 4, "{told:#?}");
        // The third execution, the settings that others followed at once, and those that were refused.
        assert_eq!(told[2], "3 Settings { cells: [3, 4], taken: Ok(true) }");
        assert!(told[3].starts_with("0 Execution { scan: Scan { now: 9,"), "{told:#?}");
    }
}
