//! A block whose version has another interface than its lane was laid out for.
//!
//! The block executes on cells of its own; by name its arguments come out of the lane's and its results go there.

use super::tap::{Tape, Taps};
use crate::layout::exponent;
use latchwork_block::upgrade::Mapping;
use latchwork_block::{Class, Fault, Instance, Scan};
use std::ops::Range;

/// Between a lane's cells and a version that was laid out otherwise; using it allocates nothing.
pub struct Adapter {
    mapping: Mapping,
    /// Indices of the arguments among `cells`.
    ins: Box<[u32]>,
    /// Arguments of the version, then its results.
    cells: Box<[u64]>,
    reals: Box<[(u32, u64)]>,
    /// From the first to behind the last result in the lane.
    results: Range<u32>,
}

impl Adapter {
    /// Between a laid-out version, whose arguments stand in the lane's cells `ins` and whose results in `outs`, and the one
    /// that executes.
    ///
    /// # Panics
    /// When there is not one place per cell of the laid-out version.
    pub fn new(laid_out: &Class, ins: &[u32], outs: &[u32], executed: &Class) -> Self {
        assert_eq!((ins.len(), outs.len()), (laid_out.argument_cells(), laid_out.output_cells()), "one place per cell");
        let mapping = Mapping::new(laid_out, executed).placed(ins, outs);
        let (mut reals, mut at) = (Vec::new(), 0);
        for port in &executed.outputs {
            if !port.signal
                && let Some(cell) = mapping.result(at)
            {
                reals.extend(exponent(port).map(|mask| (cell, mask)));
            }
            at += 1 + u32::from(port.signal);
        }
        let arguments = executed.argument_cells();
        Self {
            mapping,
            ins: (0..arguments as u32).collect(),
            cells: vec![0; arguments + executed.output_cells()].into(),
            reals: reals.into(),
            results: outs.iter().min().map_or(0..0, |first| *first..outs.iter().max().unwrap_or(first) + 1),
        }
    }

    /// Plain real outputs of the version in the lane's cells, with their exponent masks.
    pub(super) fn reals(&self) -> &[(u32, u64)] {
        &self.reals
    }

    /// The lane's cells with its results, and perhaps with those of others between them.
    pub(super) fn results(&self) -> Range<u32> {
        self.results.clone()
    }

    /// Executes the version; after a fault no cell of the lane has changed. Taps hear what the version itself gets and gives.
    #[cold]
    pub(super) fn execute(
        &mut self,
        instance: &mut Instance,
        scan: Scan,
        taps: Option<(&mut Taps, &mut Tape)>,
        cells: &mut [u64],
    ) -> Result<(), Fault> {
        let Self { mapping, ins, cells: own, .. } = self;
        mapping.arguments(cells, own);
        let out = ins.len() as u32;
        match taps {
            Some((taps, tape)) => taps.execute(tape, instance, scan, ins, out, own)?,
            None => instance.execute(scan, ins, out, own)?,
        }
        mapping.results(&own[ins.len()..], cells);
        Ok(())
    }
}
