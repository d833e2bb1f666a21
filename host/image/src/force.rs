//! Forces: a tag that an operator holds at a value, whatever its writer says.
//!
//! The board is the operators' side: what is forced, by whom. Each writer has an inbox that it empties once per
//! publication (one atomic load while nothing changes) and applies to its cells last, so every reader sees the
//! forced value. Changes travel through a bounded lock-free queue; the writer never waits or allocates.

use crate::TagId;
use std::collections::BTreeMap;

/// Changes of forces that may be under way to one writer at once.
const IN_FLIGHT: usize = 256;
/// Forces that one writer can hold.
const PER_WRITER: usize = 256;

#[derive(Clone, Copy, Debug)]
struct Change {
    slot: u32,
    /// Bits of the cell that the force covers: all, or the one flag of an alarm or command word.
    mask: u64,
    /// `None` takes the force away.
    bits: Option<u64>,
}

/// A force in effect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Forced {
    /// The forced value as a cell of the tag's type.
    pub cell: u64,
    /// Who forced it.
    pub user: String,
    /// Since when, plant time in ns.
    pub since: u64,
}

/// Why a force was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ForceError {
    /// The writer has not yet taken earlier changes.
    #[error("the writer of this tag has not yet taken {IN_FLIGHT} earlier changes of forces; try again")]
    Busy,
    /// The writer holds as many forces as it can.
    #[error("{PER_WRITER} tags of this writer are forced already; take one away first")]
    Full,
    /// The tag has no force.
    #[error("the tag is not forced")]
    NotForced,
    /// No such writer.
    #[error("tag has no writer that could be forced")]
    NoWriter,
}

/// The operators' side of all forces of a plant.
#[derive(Default)]
pub struct ForceBoard {
    forced: BTreeMap<TagId, (usize, Forced)>,
    writers: Vec<rtrb::Producer<Change>>,
}

impl ForceBoard {
    /// Adds the next writer, numbered from 0 like the regions of the tag table, and returns its inbox.
    pub fn add_writer(&mut self) -> ForceInbox {
        let (producer, consumer) = rtrb::RingBuffer::new(IN_FLIGHT);
        self.writers.push(producer);
        ForceInbox { changes: consumer, applied: Vec::with_capacity(PER_WRITER) }
    }

    /// Forces cell `slot` (or the bit `bit` of it) of writer `writer` to `forced.cell`.
    pub fn force(
        &mut self,
        tag: TagId,
        writer: usize,
        slot: u32,
        bit: Option<u8>,
        forced: Forced,
    ) -> Result<(), ForceError> {
        let held = self.forced.values().filter(|(w, _)| *w == writer).count();
        if held >= PER_WRITER && !self.forced.contains_key(&tag) {
            return Err(ForceError::Full);
        }
        let (mask, bits) = match bit {
            Some(b) => (1 << b, (forced.cell & 1) << b),
            None => (u64::MAX, forced.cell),
        };
        self.send(writer, Change { slot, mask, bits: Some(bits) })?;
        self.forced.insert(tag, (writer, forced));
        Ok(())
    }

    /// Takes a force away; the writer's own value is back at its next publication.
    pub fn unforce(&mut self, tag: TagId, slot: u32, bit: Option<u8>) -> Result<Forced, ForceError> {
        let writer = self.forced.get(&tag).ok_or(ForceError::NotForced)?.0;
        let mask = bit.map_or(u64::MAX, |b| 1 << b);
        self.send(writer, Change { slot, mask, bits: None })?;
        self.forced.remove(&tag).map(|(_, f)| f).ok_or(ForceError::NotForced)
    }

    /// What is forced now, in the order of the tags.
    pub fn list(&self) -> impl Iterator<Item = (TagId, &Forced)> {
        self.forced.iter().map(|(tag, (_, forced))| (*tag, forced))
    }

    fn send(&mut self, writer: usize, change: Change) -> Result<(), ForceError> {
        let producer = self.writers.get_mut(writer).ok_or(ForceError::NoWriter)?;
        producer.push(change).map_err(|_| ForceError::Busy)
    }
}

/// A writer's side: the forces on its cells.
pub struct ForceInbox {
    changes: rtrb::Consumer<Change>,
    applied: Vec<(u32, u64, u64)>,
}

impl ForceInbox {
    /// Takes what operators changed since the last call; true when there was something. One atomic load when nothing was;
    /// never allocates.
    #[inline]
    pub fn update(&mut self) -> bool {
        let mut changed = false;
        while let Ok(change) = self.changes.pop() {
            changed = true;
            self.applied.retain(|(slot, mask, _)| (*slot, *mask) != (change.slot, change.mask));
            if let Some(bits) = change.bits
                && self.applied.len() < self.applied.capacity()
            {
                self.applied.push((change.slot, change.mask, bits));
                self.applied.sort_unstable_by_key(|(slot, ..)| *slot);
            }
        }
        changed
    }

    /// True while any cell is forced.
    #[inline]
    pub fn any(&self) -> bool {
        !self.applied.is_empty()
    }

    /// Writes the forced values of cells `from..to` over the writer's own.
    #[inline]
    pub fn apply(&self, cells: &mut [u64], from: u32, to: u32) {
        let start = self.applied.partition_point(|(slot, ..)| *slot < from);
        for (slot, mask, bits) in self.applied[start..].iter().take_while(|(slot, ..)| *slot < to) {
            if let Some(cell) = cells.get_mut(*slot as usize) {
                *cell = *cell & !mask | bits;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn by(cell: u64) -> Forced {
        Forced { cell, user: "op".into(), since: 0 }
    }

    #[test]
    fn a_force_holds_until_it_is_taken_away() {
        let mut board = ForceBoard::default();
        let mut inbox = board.add_writer();
        board.force(TagId(3), 0, 1, None, by(42)).unwrap();
        assert_eq!(board.list().count(), 1);
        let mut cells = [1, 2, 3];
        inbox.update();
        inbox.apply(&mut cells, 0, 3);
        assert_eq!(cells, [1, 42, 3]);
        board.unforce(TagId(3), 1, None).unwrap();
        inbox.update();
        let mut cells = [1, 2, 3];
        inbox.apply(&mut cells, 0, 3);
        assert_eq!(cells, [1, 2, 3]);
        assert_eq!(board.unforce(TagId(3), 1, None), Err(ForceError::NotForced));
    }

    #[test]
    fn one_flag_of_a_word_is_forced_alone() {
        let mut board = ForceBoard::default();
        let mut inbox = board.add_writer();
        board.force(TagId(0), 0, 0, Some(2), by(1)).unwrap();
        board.force(TagId(1), 0, 0, Some(0), by(0)).unwrap();
        inbox.update();
        let mut cells = [0b0011];
        inbox.apply(&mut cells, 0, 1);
        assert_eq!(cells, [0b0110]);
    }

    #[test]
    fn too_many_forces_are_refused_not_lost() {
        let mut board = ForceBoard::default();
        let mut inbox = board.add_writer();
        for n in 0..PER_WRITER as u32 {
            board.force(TagId(n), 0, n, None, by(1)).unwrap();
            inbox.update();
        }
        assert_eq!(board.force(TagId(9999), 0, 9999, None, by(1)), Err(ForceError::Full));
        board.force(TagId(0), 0, 0, None, by(2)).unwrap();
        assert_eq!(board.force(TagId(0), 7, 0, None, by(2)), Err(ForceError::NoWriter));
    }
}
