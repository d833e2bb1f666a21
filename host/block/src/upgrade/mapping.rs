//! How the arguments of one version of a class become those of another, and the results come back: by name.

use crate::Class;

/// A plan for moving argument and result cells between two versions; applying it allocates nothing.
///
/// Cells are those of [`crate::Instance::execute`]: inputs, each signal's quality behind its value, then the commands word;
/// outputs likewise, then the alarms word. A port of the same name and type is the same port; a plain port and a signal of
/// the same type are, too (a plain one is good). Commands and alarms go by name, whatever their bits.
#[derive(Clone, Debug)]
pub struct Mapping {}

impl Mapping {
    /// Between the version whose cells are at hand and the one that executes.
    pub fn new(laid_out: &Class, executed: &Class) -> Self {
        let _ = (laid_out, executed);
        todo!()
    }

    /// Both versions have the same cells: nothing need be moved.
    pub fn is_identity(&self) -> bool {
        todo!()
    }

    /// Arguments for the version that executes; a port that the other one does not have reads 0, a signal with quality bad.
    pub fn arguments(&self, laid_out: &[u64], executed: &mut [u64]) {
        let _ = (laid_out, executed);
        todo!()
    }

    /// Its results as the other version's; what it does not have any more stays as it is, alarms are off.
    pub fn results(&self, executed: &[u64], laid_out: &mut [u64]) {
        let _ = (executed, laid_out);
        todo!()
    }
}
