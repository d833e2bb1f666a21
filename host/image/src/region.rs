//! A region: cells with one writer, published as consistent snapshots under a sequence lock.
//!
//! Two buffers take turns, so a writer that the scheduler stops in the middle of a publication leaves the previous
//! one whole: a real-time reader on the same CPU never has to wait for it. A reader starts over only when the writer
//! published twice while it was reading. The sequence counts half steps: `2k` says publication `k` is complete in
//! buffer `k & 1`; `2k + 1` says the writer is filling the other buffer, `(k + 1) & 1`.

use crate::ForceInbox;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering, fence};

struct Shared {
    sequence: AtomicU64,
    buffers: [Buffer; 2],
}

struct Buffer {
    time: AtomicU64,
    cells: Box<[AtomicU64]>,
}

impl Buffer {
    fn new(initial: &[u64]) -> Self {
        Self { time: AtomicU64::new(0), cells: initial.iter().map(|c| AtomicU64::new(*c)).collect() }
    }
}

/// The only writer of a region.
pub struct RegionWriter {
    shared: Arc<Shared>,
    /// Forces on its cells, where the writer itself knows nothing of them, and room for the forced cells.
    held: Option<(ForceInbox, Vec<u64>)>,
}

/// A reader of a region; clone it for each lane, driver or display that reads.
#[derive(Clone)]
pub struct RegionReader {
    shared: Arc<Shared>,
}

/// Makes a region whose readers see `initial` until the first publication.
pub fn region(initial: &[u64]) -> (RegionWriter, RegionReader) {
    let shared =
        Arc::new(Shared { sequence: AtomicU64::new(0), buffers: [Buffer::new(initial), Buffer::new(initial)] });
    (RegionWriter { shared: Arc::clone(&shared), held: None }, RegionReader { shared })
}

impl RegionWriter {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.shared.buffers[0].cells.len()
    }

    /// True for a region without cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A reader of this region.
    pub fn reader(&self) -> RegionReader {
        RegionReader { shared: Arc::clone(&self.shared) }
    }

    /// Lets forces hold cells of this region: every publication from now on shows them.
    pub fn hold(&mut self, forces: ForceInbox) {
        let room = Vec::with_capacity(self.len());
        self.held = Some((forces, room));
    }

    /// Takes the forces that have changed; true when a publication would show it.
    pub fn forces_changed(&mut self) -> bool {
        self.held.as_mut().is_some_and(|(forces, _)| forces.update())
    }

    /// Publishes all cells at plant time `time` (ns). Never waits. Cells beyond the region's length are ignored.
    pub fn publish(&mut self, cells: &[u64], time: u64) {
        if let Some((forces, room)) = &mut self.held {
            forces.update();
            if forces.any() {
                room.clear();
                room.extend_from_slice(cells);
                forces.apply(room, 0, u32::MAX);
                let forced = std::mem::take(room);
                self.write(&forced, time);
                if let Some((_, room)) = &mut self.held {
                    *room = forced;
                }
                return;
            }
        }
        self.write(cells, time);
    }

    fn write(&self, cells: &[u64], time: u64) {
        let sequence = self.shared.sequence.load(Ordering::Relaxed);
        self.shared.sequence.store(sequence.wrapping_add(1), Ordering::Relaxed);
        // Keeps the stores below from becoming visible before the odd sequence number.
        fence(Ordering::Release);
        let buffer = &self.shared.buffers[(sequence / 2 + 1) as usize & 1];
        buffer.time.store(time, Ordering::Relaxed);
        for (slot, cell) in buffer.cells.iter().zip(cells) {
            slot.store(*cell, Ordering::Relaxed);
        }
        self.shared.sequence.store(sequence.wrapping_add(2), Ordering::Release);
    }
}

impl RegionReader {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.shared.buffers[0].cells.len()
    }

    /// True for a region without cells.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of publications so far; 0 means that nothing was published yet.
    pub fn publications(&self) -> u64 {
        self.shared.sequence.load(Ordering::Acquire) / 2
    }

    /// Copies the wanted cells, `(slot, destination)`, out of one publication and returns its time (ns).
    ///
    /// # Panics
    /// If a slot or destination is out of range: they are computed at assembly, never at run time.
    #[inline]
    pub fn gather(&self, wanted: &[(u32, u32)], into: &mut [u64]) -> u64 {
        self.consistent(|buffer| {
            for (slot, destination) in wanted {
                into[*destination as usize] = buffer.cells[*slot as usize].load(Ordering::Relaxed);
            }
        })
    }

    /// Copies one publication from its start, up to the shorter of the two lengths, and returns its time (ns).
    pub fn copy_to(&self, into: &mut [u64]) -> u64 {
        self.consistent(|buffer| {
            for (cell, slot) in into.iter_mut().zip(&buffer.cells) {
                *cell = slot.load(Ordering::Relaxed);
            }
        })
    }

    /// One cell of the latest publication.
    pub fn cell(&self, slot: u32) -> u64 {
        let mut cell = [0];
        self.gather(&[(slot, 0)], &mut cell);
        cell[0]
    }

    #[inline]
    fn consistent(&self, mut read: impl FnMut(&Buffer)) -> u64 {
        loop {
            let before = self.shared.sequence.load(Ordering::Acquire);
            let publication = before / 2;
            let buffer = &self.shared.buffers[publication as usize & 1];
            let time = buffer.time.load(Ordering::Relaxed);
            read(buffer);
            // Keeps the loads above from moving below the check.
            fence(Ordering::Acquire);
            let after = self.shared.sequence.load(Ordering::Relaxed);
            // This buffer is written to again from half step 2(k+1)+1 on.
            if after.wrapping_sub(publication * 2) <= 2 {
                return time;
            }
            std::hint::spin_loop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;

    #[test]
    fn readers_see_the_latest_publication() {
        let (mut writer, reader) = region(&[7, 8]);
        assert_eq!((reader.cell(1), reader.publications()), (8, 0));
        for n in 1..10 {
            writer.publish(&[n, n * 2], n);
            let mut cells = [0; 2];
            assert_eq!(reader.copy_to(&mut cells), n);
            assert_eq!(cells, [n, n * 2]);
            assert_eq!(reader.publications(), n);
        }
    }

    #[test]
    fn forces_hold_cells_of_a_writer_that_does_not_know() {
        let (mut writer, reader) = region(&[0, 0]);
        let mut board = crate::ForceBoard::default();
        writer.hold(board.add_writer());
        writer.publish(&[1, 2], 1);
        let forced = crate::Forced { cell: 9, user: "op".into(), since: 0 };
        board.force(crate::TagId(0), 0, 1, None, forced).unwrap();
        assert!(writer.forces_changed() && !writer.forces_changed());
        writer.publish(&[3, 4], 2);
        assert_eq!((reader.cell(0), reader.cell(1)), (3, 9));
        board.unforce(crate::TagId(0), 1, None).unwrap();
        writer.publish(&[5, 6], 3);
        assert_eq!((reader.cell(0), reader.cell(1)), (5, 6));
    }

    #[test]
    fn a_gather_places_what_was_asked() {
        let (mut writer, reader) = region(&[0; 4]);
        writer.publish(&[10, 11, 12, 13], 1);
        let mut cells = [0; 3];
        reader.gather(&[(3, 0), (1, 2)], &mut cells);
        assert_eq!(cells, [13, 0, 11]);
    }

    /// Stress: a snapshot is never a mixture of two publications and never goes back, whatever the writer does.
    #[test]
    fn snapshots_are_consistent_under_contention() {
        const CELLS: usize = 257;
        const PUBLICATIONS: u64 = 200_000;
        let (mut writer, reader) = region(&[0; CELLS]);
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            for _ in 0..3 {
                let (reader, done) = (reader.clone(), &done);
                scope.spawn(move || {
                    let (mut cells, mut last, mut seen) = ([0; CELLS], 0, 0u64);
                    while !done.load(Ordering::Relaxed) || seen == 0 {
                        let time = reader.copy_to(&mut cells);
                        assert!(cells.iter().all(|c| *c == time), "a torn snapshot");
                        assert!(time >= last, "a snapshot went back from {last} to {time}");
                        last = time;
                        seen += 1;
                    }
                });
            }
            for n in 1..=PUBLICATIONS {
                writer.publish(&[n; CELLS], n);
            }
            done.store(true, Ordering::Relaxed);
        });
        assert_eq!(reader.publications(), PUBLICATIONS);
    }
}
