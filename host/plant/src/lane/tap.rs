//! Taps: what a block gets and gives at each execution, copied into a bounded ring for whoever listens off the lane.
//!
//! The lane writes words, a frame at a time and whole or not at all; a frame that finds no room is counted, and the next one
//! that does says how many were missed. An execution fills one slot of the ring, in place; a longer frame takes several. Settings that a block took are not missed: they wait for room before everything
//! else. Nothing here allocates but [`tap`] itself.
//!
//! ```text
//! header: kind │ flags << 8 │ words behind it << 16 │ frames missed before it << 32
//! state:      time of the last execution, retained cells
//! execution:  now, elapsed, ns it took (0: not measured), argument cells, output cells (none after a fault)
//! settings:   setting cells
//! ```
//!
//! A tap that is put on a block at work tells no execution before its state, which is saved in the lane's spare time
//! ([`super::save`]).

mod reader;

pub use reader::{Frame, State, TapReader};

use super::{Block, Lane, Report};
use latchwork_block::{Class, Fault, FaultKind, Instance, Scan};
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
const WAITS: u64 = 6;

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
/// Words of an execution before its cells: header, now, elapsed, ns it took.
const HEAD: usize = 4;
/// Reports that one request may lead to; none is taken while there is no room for them.
pub(super) const REPORTS: usize = 2;

/// The lane's end of a tap.
pub struct Tap {
    // What every execution touches comes first.
    to: rtrb::Producer<u64>,
    /// Words of a slot: an execution without faults.
    slot: u32,
    missed: u32,
    ended: bool,
    /// The state came with which what it tells begins.
    live: bool,
    settings_wait: bool,
    timer: Option<Timer>,
    /// Header and cells of settings that the block took, while they wait for room; whole slots.
    settings: Box<[u64]>,
    /// Another frame in the making, as many slots as the longest takes.
    frame: Box<[u64]>,
    /// It is for this version of the block alone.
    version: Option<u64>,
    /// The block may be asked for its state.
    saves: bool,
    /// Argument and output cells, and settings, of the class it was made for.
    shape: (usize, usize),
    setting_cells: usize,
}

/// The taps of a block, by [`TapSlot`].
#[derive(Default)]
pub struct Taps([Option<Box<Tap>>; 2]);

/// Executions that a tap needs room for, of a block in a lane of this period, ns; 0: edges come, nobody knows when.
pub fn room(every: u64) -> usize {
    let executions = ROOM.checked_div(every).unwrap_or(u64::MAX);
    executions.clamp(EXECUTIONS.0, EXECUTIONS.1) as usize
}

/// A new tap of a block of a class with room for `frames` executions. With a timer each execution is timed: that costs two
/// looks at the clock.
pub fn tap(class: &Class, frames: usize, timer: Option<Timer>) -> (Box<Tap>, TapReader) {
    let (arguments, outputs) = (class.argument_cells(), class.output_cells());
    let slot = HEAD + arguments + outputs;
    let settings = (1 + class.settings.len()).next_multiple_of(slot);
    let longest = (2 + class.retained.len()).next_multiple_of(slot).max(settings);
    let (to, from) = rtrb::RingBuffer::new((slot * frames.max(2)).max(longest));
    let tap = Tap {
        to,
        slot: slot as u32,
        missed: 0,
        ended: false,
        live: false,
        settings_wait: false,
        timer,
        settings: vec![0; settings].into(),
        frame: vec![0; longest].into(),
        version: None,
        saves: true,
        shape: (arguments, outputs),
        setting_cells: class.settings.len(),
    };
    (Box::new(tap), TapReader::new(from, slot, longest, arguments))
}

impl Tap {
    /// For this version of the block alone ([`crate::supervisor::Recipe::version`]): with another one it ends at once.
    pub fn only(&mut self, version: u64) {
        self.version = Some(version);
    }

    /// The block is not asked for its state: it would fail.
    pub fn without_states(&mut self) {
        self.saves = false;
    }

    /// The state that a block has now; `None` when it is cold.
    pub(super) fn state(&mut self, last: u64, state: Option<&[u64]>) {
        self.frame[1] = last;
        let end = self.cells(2, state.unwrap_or(&[]));
        self.begin(if state.is_none() { COLD } else { 0 }, end);
    }

    /// Sends a state in the making, with which what it tells begins.
    fn begin(&mut self, flags: u64, words: usize) {
        self.live |= self.send(STATE, flags, words);
    }

    /// The block executes another version from now on; this one may come back.
    pub(super) fn waits(&mut self) {
        self.send(WAITS, 0, 1);
    }

    /// The block got settings, and took them or not, or faulted over them.
    pub(super) fn settings(&mut self, cells: &[u64], taken: Result<bool, FaultKind>) {
        let flags = match taken {
            // What comes after them means nothing without them.
            Ok(true) if cells.len() == self.setting_cells => {
                self.missed = self.missed.saturating_add(u32::from(self.settings_wait));
                self.settings[1..=cells.len()].copy_from_slice(cells);
                self.settings_wait = true;
                self.send_settings();
                return;
            }
            Ok(true) => 0,
            Ok(false) => REFUSED,
            Err(kind) => fault_flags(kind),
        };
        let end = self.cells(1, cells);
        self.send(SETTINGS, flags, end);
    }

    /// Sends settings that wait; false when they still do.
    fn send_settings(&mut self) -> bool {
        if !self.settings_wait {
            return true;
        }
        let length = (self.setting_cells as u64) << LENGTH;
        self.settings[0] = SETTINGS | length | u64::from(self.missed) << MISSED;
        let sent = !self.ended && self.to.push_entire_slice(&self.settings).is_ok();
        if sent {
            (self.missed, self.settings_wait) = (0, false);
        }
        sent
    }

    /// True when it found room.
    fn send(&mut self, kind: u64, flags: u64, words: usize) -> bool {
        if self.ended {
            return false;
        }
        let ready = self.send_settings();
        let length = (words as u64 - 1) << LENGTH;
        self.frame[0] = kind | flags | length | u64::from(self.missed) << MISSED;
        let whole = words.next_multiple_of(self.slot as usize);
        let sent = ready && self.to.push_entire_slice(&self.frame[..whole]).is_ok();
        self.missed = if sent { 0 } else { self.missed.saturating_add(1) };
        sent
    }

    fn cells(&mut self, at: usize, cells: &[u64]) -> usize {
        self.frame[at..at + cells.len()].copy_from_slice(cells);
        at + cells.len()
    }

    /// The slot for an execution, with its arguments, which the outputs may overwrite; none without room.
    #[inline]
    fn open(&mut self, ins: &[u32], cells: &[u64]) -> Option<Slot<'_>> {
        if self.settings_wait && !self.send_settings() {
            self.missed = self.missed.saturating_add(1);
            return None;
        }
        let Self { to, slot, missed, .. } = self;
        let Ok(mut chunk) = to.write_chunk(*slot as usize) else {
            *missed = missed.saturating_add(1);
            return None;
        };
        // All frames are whole slots, so that none stands at both ends of the ring.
        let words = chunk.as_mut_slices().0;
        words[0] = u64::from(std::mem::take(missed)) << MISSED;
        for (word, cell) in words[HEAD..].iter_mut().zip(ins) {
            *word = cells[*cell as usize];
        }
        Some(Slot { chunk, arguments: ins.len() })
    }

    /// No further frame; the reader hears of it as soon as there is room.
    pub(super) fn end(&mut self) {
        self.send(ENDED, 0, 1);
        self.ended = true;
    }
}

/// An execution on its way.
struct Slot<'a> {
    chunk: rtrb::chunks::WriteChunk<'a, u64>,
    arguments: usize,
}

impl Slot<'_> {
    #[inline]
    fn close(mut self, scan: Scan, took: u64, outputs: Result<&[u64], FaultKind>) {
        let words = self.chunk.as_mut_slices().0;
        let cells = HEAD + self.arguments;
        let end = match outputs {
            Ok(outputs) => {
                words[cells..cells + outputs.len()].copy_from_slice(outputs);
                cells + outputs.len()
            }
            Err(_) => cells,
        };
        let flags = if scan.first { FIRST } else { 0 } | outputs.err().map_or(0, fault_flags);
        words[0] |= EXECUTION | flags | (end as u64 - 1) << LENGTH;
        words[1..HEAD].copy_from_slice(&[scan.now, scan.elapsed, took]);
        self.chunk.commit_all();
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
        let recorder = recorder.and_then(|tap| tap.open(ins, cells));
        let shadow = shadow.and_then(|tap| tap.open(ins, cells));
        let begun = timer.as_ref().map(|now| now());
        let result = instance.execute(scan, ins, out, cells);
        let took = timer.zip(begun).map_or(0, |(now, begun)| now().saturating_sub(begun));
        let outputs = out as usize..out as usize + instance.class().output_cells();
        let outputs = result.as_ref().map(|()| &cells[outputs]).map_err(|fault| fault.kind);
        for slot in [recorder, shadow].into_iter().flatten() {
            slot.close(scan, took, outputs);
        }
        result
    }

    /// The block got settings, and took them or not, or faulted over them.
    pub(super) fn settings(&mut self, cells: &[u64], taken: Result<bool, FaultKind>) {
        self.each().for_each(|tap| tap.settings(cells, taken));
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
    pub(super) fn restarted(&mut self) {
        self.each().for_each(|tap| tap.live |= tap.send(RESTARTED, 0, 1));
    }
}

impl Lane {
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
            tap.end();
            return self.send(Report::Tap(tap));
        }
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

    /// Sends a tap the state that the block has now: at once if nothing has to be saved for it, else when there is time.
    #[cold]
    pub(super) fn keyframe(&mut self, index: usize, slot: TapSlot, now: u64) {
        let Some(block) = self.parts.blocks.get_mut(index) else { return };
        if block.saves_for(slot) {
            self.want_keyframe(index as u32, slot, now);
        } else {
            block.show(slot);
        }
    }
}

impl Block {
    /// A state for this tap has to be saved.
    pub(super) fn saves_for(&self, slot: TapSlot) -> bool {
        let tap = self.rest.taps.0[slot as usize].as_ref().filter(|tap| !tap.ended);
        let retains = self.instance.as_ref().is_some_and(|i| !i.class().retained.is_empty());
        tap.is_some_and(|tap| tap.saves) && retains && (self.ran || !self.first)
    }

    /// Sends a tap what is known of the state without saving it.
    fn show(&mut self, slot: TapSlot) {
        let Self { instance, last, first, ran, rest, .. } = self;
        let Some(tap) = rest.taps.0[slot as usize].as_mut().filter(|tap| !tap.ended) else { return };
        tap.frame[1] = *last;
        match instance {
            None => drop(tap.send(STATE, ABSENT, 2)),
            Some(_) if *first && !*ran => tap.begin(COLD, 2),
            Some(instance) if instance.class().retained.is_empty() => tap.begin(0, 2),
            Some(_) => drop(tap.send(STATE, ABSENT | FAULTED, 2)),
        }
    }

    /// Saves the state for a tap and sends it.
    pub(super) fn save_for(&mut self, slot: TapSlot) -> Result<(), Fault> {
        if !self.saves_for(slot) {
            self.show(slot);
            return Ok(());
        }
        let (Some(instance), Some(tap)) = (&mut self.instance, &mut self.rest.taps.0[slot as usize]) else {
            return Ok(());
        };
        tap.frame[1] = self.last;
        let end = 2 + instance.class().retained.len();
        match instance.save_into(&mut tap.frame[2..end]) {
            Ok(_) => tap.begin(0, end),
            Err(fault) => {
                tap.send(STATE, ABSENT | FAULTED, 2);
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
        ended.end();
        let mut taps = Taps([Some(ended), None]);
        taps.settings(&[0; 100], Ok(true));
        assert!(!taps.any());
    }

    #[test]
    fn settings_that_find_no_room_come_before_everything_else() {
        let setting = |name: &str| Port { path: name.into(), ty: Type::U32, signal: false, doc: None };
        let mut class = Class::default();
        class.settings = vec![setting("a"), setting("b")];
        let (mut tap, mut reader) = tap(&class, 2, None);
        let scan = |now| Scan { now, elapsed: 0, first: false };
        let execute =
            |tap: &mut Tap, now| tap.open(&[], &[]).into_iter().for_each(|slot| slot.close(scan(now), 0, Ok(&[])));
        // Two executions are all there is room for.
        (0..3).for_each(|now| execute(&mut tap, now));
        tap.settings(&[1, 2], Ok(true));
        tap.settings(&[3, 4], Ok(true));
        tap.settings(&[5, 6], Ok(false));
        let mut told = Vec::new();
        while let Some((missed, frame)) = reader.next_frame() {
            told.push(format!("{missed} {frame:?}"));
        }
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
