//! What comes out of an execution, and whether it is the same in two instances.

use super::{Run, Side, Trial, Twin};
use crate::fuzz::failure::{Failure, different, equal};
use crate::fuzz::report::Kind;
use crate::fuzz::values::real;
use latchwork_block::{Class, Port};
use latchwork_image::Type;

impl Trial<'_> {
    /// Memory and NaN of the first.
    pub(super) fn look(&mut self, run: &mut Run) {
        run.done += 1;
        let memory = run.first.instance.memory();
        self.sums.memory = self.sums.memory.max(memory);
        if run.done.is_power_of_two() {
            self.memory.push(memory);
        }
        let outputs = &run.first.cells[self.ins.len()..];
        for ((ty, cell), nan) in self.reals.iter().zip(outputs).zip(&mut self.sums.nan) {
            if let Some(ty) = ty
                && real(ty, *cell).is_nan()
            {
                nan.0 = true;
                nan.1 |= run.finite;
            }
        }
    }

    /// The same outputs as those of the first, or a failure.
    pub(super) fn same(&self, run: &Run, other: &Side, kind: Kind, at: Option<(usize, u32)>) -> Result<(), Failure> {
        let from = self.ins.len();
        let (expected, got) = (&run.first.cells[from..], &other.cells[from..]);
        if expected == got || self.reals.iter().zip(expected.iter().zip(got)).all(|(r, (a, b))| equal(r, *a, *b)) {
            return Ok(());
        }
        // What should be is what the one does that nobody disturbed.
        let disturbed = kind == Kind::NotDeterministic && run.told != Twin { saves: true, refusals: true };
        let (expected, got) = if disturbed { (got, expected) } else { (expected, got) };
        Err(Failure { expected: expected.into(), got: got.into(), ..different(kind, "", at) })
    }

    /// No value of the cells is NaN or infinite.
    pub(super) fn finite(&self, cells: &[u64], ports: impl Fn(&Class) -> &[Port]) -> bool {
        let mut at = 0;
        ports(self.class()).iter().all(|port| {
            let cell = cells[at];
            at += 1 + usize::from(port.signal);
            !matches!(port.ty, Type::F32 | Type::F64) || real(&port.ty, cell).is_finite()
        })
    }

    /// Indices of the output cells that differ, as a failure has them.
    pub(in crate::fuzz) fn differing(&self, failure: &Failure) -> Vec<usize> {
        let pairs = failure.expected.iter().zip(&failure.got).zip(&self.reals).enumerate();
        pairs.filter(|(_, ((a, b), real))| !equal(real, **a, **b)).map(|(i, _)| i).collect()
    }
}
