//! Fuzzing of blocks: random sequences of inputs, times, commands, settings and restarts, and what goes wrong under them.
//!
//! ```text
//! seed ─► generate ─Sequence─► trial (the block, its twin, one restored from its state) ─► failure
//!                                                                                            │
//!                     report ◄─ case of a test file ◄─ shrink (fewer steps, simpler values) ◄┘
//! ```
//!
//! Three instances get the same calls. The *first* is never stopped. Its *twin* is told nothing of settings that were refused,
//! and is never asked for its state. The *restored* one is made anew at every restart, from the state of the first. All three
//! must have the same outputs for ever.
//!
//! A seed repeats a search that is bounded by its number of sequences, but for what the machine's clock says.

mod constants;
mod difference;
mod failure;
mod generate;
mod options;
mod report;
mod search;
mod sequence;
mod shares;
mod shrink;
mod simple;
mod sums;
mod trial;
mod values;
mod write;

pub use options::{Options, Progress};
pub use report::{Finding, Kind, Report};
pub(crate) use search::TOO_FEW;
pub use search::fuzz;
