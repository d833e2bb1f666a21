//! The ring that frames go through: whole or not at all, an execution in one piece.

use super::{EXECUTION, FIRST, HEAD, HEADER, LENGTH, SKIP, TapReader, fault_flags};
use latchwork_block::{FaultKind, Scan};

/// What the flight recorder's taps on the blocks of a lane write. Without [`tape`] there is none.
#[derive(Default)]
pub struct Tape(pub(super) Option<Ring>);

/// A tape with room for so many words, and who reads it. A frame takes up to twice its length.
pub fn tape(words: usize) -> (Tape, TapReader) {
    let (ring, reader) = Ring::new(words, 1);
    (Tape(Some(ring)), reader)
}

/// A ring of one tap: so many executions of so many words; one other frame of the longest has room in any case.
pub(super) fn own(slot: usize, frames: usize, longest: usize) -> (Ring, TapReader) {
    Ring::new((slot * frames).max(longest.next_multiple_of(slot)), slot)
}

pub(super) struct Ring {
    to: rtrb::Producer<u64>,
    capacity: usize,
    /// Where the next frame stands.
    at: usize,
    /// Frames are multiples of so many words.
    unit: usize,
}

impl Ring {
    fn new(words: usize, unit: usize) -> (Self, TapReader) {
        let (to, from) = rtrb::RingBuffer::new(words);
        (Self { to, capacity: words, at: 0, unit }, TapReader::new(from, unit))
    }

    /// A frame; false without room.
    pub(super) fn push(&mut self, frame: &[u64]) -> bool {
        let whole = frame.len().next_multiple_of(self.unit);
        let Ok(mut chunk) = self.to.write_chunk(whole) else { return false };
        let (first, second) = chunk.as_mut_slices();
        let (begin, rest) = frame.split_at(frame.len().min(first.len()));
        first[..begin.len()].copy_from_slice(begin);
        second[..rest.len()].copy_from_slice(rest);
        chunk.commit_all();
        self.advance(whole);
        true
    }

    /// The place for an execution of so many words; none without room.
    #[inline]
    pub(super) fn open(&mut self, words: usize) -> Option<Slot<'_>> {
        // It is written in place, so it does not stand at both ends.
        if self.capacity - self.at < words {
            self.skip(words)?;
        }
        let chunk = self.to.write_chunk(words).ok()?;
        let end = self.at + words;
        Some(Slot { chunk, at: &mut self.at, end: if end == self.capacity { 0 } else { end }, arguments: 0 })
    }

    /// Leaves the end of the ring empty.
    #[cold]
    fn skip(&mut self, words: usize) -> Option<()> {
        let left = self.capacity - self.at;
        if self.to.slots() < left + words {
            return None;
        }
        let mut chunk = self.to.write_chunk(left).ok()?;
        chunk.as_mut_slices().0[0] = SKIP | (left as u64 - 1) << LENGTH;
        chunk.commit_all();
        self.advance(left);
        Some(())
    }

    fn advance(&mut self, words: usize) {
        self.at = (self.at + words) % self.capacity;
    }
}

/// An execution on its way.
pub(super) struct Slot<'a> {
    chunk: rtrb::chunks::WriteChunk<'a, u64>,
    at: &'a mut usize,
    end: usize,
    arguments: usize,
}

impl Slot<'_> {
    #[inline]
    pub(super) fn begin(&mut self, header: u64, who: u64, ins: &[u32], cells: &[u64]) {
        let words = self.chunk.as_mut_slices().0;
        (words[0], words[1]) = (header, who);
        for (word, cell) in words[HEAD..].iter_mut().zip(ins) {
            *word = cells[*cell as usize];
        }
        self.arguments = ins.len();
    }

    /// With its outputs, the first cells of what is given.
    #[inline]
    pub(super) fn close(mut self, scan: Scan, took: u64, outputs: Result<&[u64], FaultKind>) {
        let words = self.chunk.as_mut_slices().0;
        // After a fault the place of the outputs is there, and empty.
        let flags = if scan.first { FIRST } else { 0 } | outputs.err().map_or(0, fault_flags);
        words[0] |= EXECUTION | flags | (words.len() as u64 - 1) << LENGTH;
        words[HEADER..HEAD].copy_from_slice(&[scan.now, scan.elapsed, took]);
        if let (Ok(outputs), Some(place)) = (outputs, words.get_mut(HEAD + self.arguments..)) {
            let some = place.len().min(outputs.len());
            place[..some].copy_from_slice(&outputs[..some]);
        }
        self.chunk.commit_all();
        *self.at = self.end;
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Frame, SETTINGS};
    use super::*;
    use proptest::prelude::*;

    #[derive(Clone, Debug)]
    enum Step {
        /// Another frame, of so many cells.
        Push(usize),
        /// An execution with so many arguments and outputs.
        Execute(usize, usize),
        /// The reader takes at most so many.
        Read(usize),
    }

    fn step() -> impl Strategy<Value = Step> {
        prop_oneof![
            (0..9usize).prop_map(Step::Push),
            (0..5usize, 0..5usize).prop_map(|(arguments, outputs)| Step::Execute(arguments, outputs)),
            (0..9usize).prop_map(Step::Read),
        ]
    }

    #[test]
    fn what_comes_while_it_is_read_waits_for_the_next_turn() {
        let (Tape(ring), mut reader) = tape(100);
        let mut ring = ring.expect("a ring");
        let frame = [SETTINGS | 2 << LENGTH, 7, 1];
        (0..3).for_each(|_| assert!(ring.push(&frame)));
        let (mut left, mut read) = (reader.waiting(), 0);
        while left > 0 && reader.next_of_all(&mut left).is_some() {
            read += 1;
            // A lane that is faster than its reader.
            (0..2).for_each(|_| assert!(ring.push(&frame)));
        }
        assert_eq!((read, reader.waiting()), (3, 6 * frame.len()));
    }

    proptest! {
        #[test]
        fn what_found_room_is_read_whole_and_in_order(words in 30usize..90, steps in prop::collection::vec(step(), 0..200)) {
            let (Tape(ring), mut reader) = tape(words);
            let mut ring = ring.expect("a ring");
            let (mut sent, mut read, mut next) = (Vec::new(), Vec::new(), 0u64);
            let mut fresh = |n: usize| -> Vec<u64> { (0..n).map(|_| { next += 1; next }).collect() };
            let mut take = |most: usize| for _ in 0..most {
                match reader.next_of_all(&mut { usize::MAX }) {
                    Some((who, 0, Frame::Settings { cells, .. })) => read.push((who, cells.to_vec(), Vec::new())),
                    Some((who, 0, Frame::Execution { arguments, outputs, .. })) => {
                        read.push((who, arguments.to_vec(), outputs.expect("no fault").to_vec()));
                    }
                    None => break,
                    other => panic!("{other:?}"),
                }
            };
            for (who, step) in (0u32..).zip(steps) {
                match step {
                    Step::Push(n) => {
                        let cells = fresh(n);
                        let head = [SETTINGS | (n as u64 + 1) << LENGTH, who.into()];
                        if ring.push(&[&head, &cells[..]].concat()) {
                            sent.push((who, cells, Vec::new()));
                        }
                    }
                    Step::Execute(a, o) => {
                        let (arguments, outputs) = (fresh(a), fresh(o));
                        let ins: Vec<u32> = (0..a as u32).collect();
                        if let Some(mut slot) = ring.open(HEAD + a + o) {
                            slot.begin(0, u64::from(who) | (a as u64) << 32, &ins, &arguments);
                            slot.close(Scan { now: 1, elapsed: 1, first: false }, 0, Ok(&outputs));
                            sent.push((who, arguments, outputs));
                        }
                    }
                    Step::Read(most) => take(most),
                }
            }
            take(usize::MAX);
            prop_assert_eq!(read, sent);
            // Whatever was in it, there is room again.
            prop_assert!(ring.open(HEAD + 10).is_some());
        }
    }
}
