//! A reader's view of chosen tags, wherever they stand: one consistent snapshot per region and refresh.

use crate::{Quality, RegionReader, Resolved};

#[derive(Clone, Copy)]
struct Entry {
    value: u32,
    quality: Option<u32>,
    bit: Option<u8>,
    not: bool,
}

/// Chosen tags of several regions, for drivers (their outputs), displays and traces.
pub struct View {
    /// Per region: the reader and what is wanted of it.
    sources: Vec<(RegionReader, Vec<(u32, u32)>)>,
    entries: Vec<Entry>,
    cells: Vec<u64>,
}

impl View {
    /// A view of `tags` in their order; `regions` by the number that locations carry.
    ///
    /// # Panics
    /// If a location names a region or slot that is not there.
    pub fn new(regions: &[RegionReader], tags: &[Resolved]) -> Self {
        let mut wanted: Vec<Vec<(u32, u32)>> = vec![Vec::new(); regions.len()];
        let (mut cells, mut entries) = (Vec::new(), Vec::new());
        for tag in tags {
            let value = cells.len() as u32;
            match tag {
                Resolved::Constant(cell) => {
                    cells.push(*cell);
                    entries.push(Entry { value, quality: None, bit: None, not: false });
                }
                Resolved::Cell { location, not } => {
                    let region = &mut wanted[location.region as usize];
                    region.push((location.slot, value));
                    cells.push(0);
                    let quality = location.quality.map(|slot| {
                        region.push((slot, value + 1));
                        cells.push(0);
                        value + 1
                    });
                    entries.push(Entry { value, quality, bit: location.bit, not: *not });
                }
            }
        }
        let sources = regions.iter().cloned().zip(wanted).filter(|(_, w)| !w.is_empty()).collect();
        let mut view = Self { sources, entries, cells };
        view.refresh();
        view
    }

    /// Takes a new snapshot of every region it looks at. Never allocates.
    pub fn refresh(&mut self) {
        for (reader, wanted) in &self.sources {
            reader.gather(wanted, &mut self.cells);
        }
    }

    /// Number of tags.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// True without tags.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Value of tag `index` at the last refresh.
    pub fn cell(&self, index: usize) -> u64 {
        let entry = &self.entries[index];
        let cell = self.cells[entry.value as usize];
        let cell = entry.bit.map_or(cell, |b| cell >> b & 1);
        if entry.not { cell ^ 1 } else { cell }
    }

    /// Quality of tag `index` at the last refresh.
    pub fn quality(&self, index: usize) -> Quality {
        self.entries[index].quality.map_or(Quality::Good, |q| Quality::from_cell(self.cells[q as usize]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Location, region};

    #[test]
    fn a_view_gathers_over_regions() {
        let (mut a, ra) = region(&[0, 0]);
        let (mut b, rb) = region(&[0]);
        let at =
            |region, slot, bit, quality, not| Resolved::Cell { location: Location { region, slot, bit, quality }, not };
        let mut view = View::new(
            &[ra, rb],
            &[
                at(0, 0, None, Some(1), false),
                at(1, 0, Some(3), None, false),
                at(1, 0, Some(3), None, true),
                Resolved::Constant(9),
            ],
        );
        a.publish(&[5, 2], 1);
        b.publish(&[0b1000], 1);
        assert_eq!(view.cell(0), 0);
        view.refresh();
        assert_eq!((0..4).map(|i| view.cell(i)).collect::<Vec<_>>(), [5, 1, 0, 9]);
        assert_eq!((view.quality(0), view.quality(1)), (Quality::Bad, Quality::Good));
    }
}
