//! Recordings: their format, and running them again.

mod compare;
mod report;
mod tolerances;

pub use compare::Comparer;
pub use report::{Deviation, FailedRun, named};
pub use tolerances::{ToleranceError, Tolerances};
