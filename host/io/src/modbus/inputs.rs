//! What was read: the driver's region, published as one snapshot per cycle.

use super::plan::Range;
use super::point::Place;
use latchwork_image::{Quality, RegionWriter};
use std::sync::Arc;

/// An input point.
#[derive(Clone, Debug)]
pub(super) struct Input {
    pub(super) name: String,
    pub(super) place: Place,
}

/// The input points and their cells. When it goes, however that happens, the points turn bad: nobody reads them on.
pub(super) struct Inputs {
    pub(super) points: Vec<Input>,
    region: RegionWriter,
    clock: Arc<dyn Fn() -> u64 + Send + Sync>,
    /// Value and quality of each point.
    cells: Vec<u64>,
}

impl Inputs {
    pub(super) fn new(points: Vec<Input>, region: RegionWriter, clock: Arc<dyn Fn() -> u64 + Send + Sync>) -> Self {
        let cells = [0, Quality::Bad.cell()].repeat(points.len());
        let mut inputs = Self { points, region, clock, cells };
        inputs.publish();
        inputs
    }

    /// Takes the words of a range.
    pub(super) fn take(&mut self, range: &Range, words: &[u16]) {
        for n in &range.points {
            let place = self.points[*n].place;
            let from = usize::from(place.address - range.start);
            let Some(words) = words.get(from..from + usize::from(place.coding.words())) else { continue };
            self.cells[2 * n] = place.decode(words);
            self.cells[2 * n + 1] = Quality::Good.cell();
        }
    }

    /// The points of a range keep their last value, which can no longer be trusted.
    pub(super) fn distrust(&mut self, range: &Range) {
        for n in &range.points {
            self.cells[2 * n + 1] = Quality::Bad.cell();
        }
    }

    /// Distrusts all points and publishes that.
    pub(super) fn lose(&mut self) {
        self.cells.chunks_exact_mut(2).for_each(|c| c[1] = Quality::Bad.cell());
        self.publish();
    }

    /// Makes everything taken since the last time visible at once.
    pub(super) fn publish(&mut self) {
        self.region.publish(&self.cells, (self.clock)());
    }
}

impl Drop for Inputs {
    fn drop(&mut self) {
        self.lose();
    }
}
