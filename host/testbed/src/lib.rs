//! Blocks without a plant: component tests at virtual time, and replays of what a plant has recorded.
//!
//! Owns the test file (`FILE.test.toml`), its runner and its reports, and the format of recordings. It must never know of
//! plants, lanes, drivers or terminals.

pub mod case;
pub mod fuzz;
pub mod replay;
