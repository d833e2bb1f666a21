//! From one version of a block to the next: what is different, and how its state gets across.
//!
//! Pure: knows classes and cells, no instances and no lanes.

mod convert;
mod difference;
mod mapping;
mod transfer;

#[cfg(test)]
mod tests;

pub use difference::{Change, Difference, Part, PortChange};
pub use mapping::Mapping;
pub use transfer::{Fate, Field, Transfer, schema};
