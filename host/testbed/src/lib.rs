//! Blocks without a plant: component tests at virtual time, fuzzing, and replays of what a plant has recorded.
//!
//! Owns the test file (`FILE.test.toml`), its runner and its reports, the search for what is wrong with a block, and the format
//! of recordings. It must never know of plants, lanes, drivers or terminals; the machine's clock is an argument.
//!
//! | for | use |
//! |---|---|
//! | a test of a component inside `cargo test` | [`Bench`] |
//! | test files | [`case`] |
//! | what nobody thought of | [`mod@fuzz`] |
//! | whether a plant would take a component | [`check`] |

mod bench;
pub mod case;
pub mod check;
mod constant;
pub mod fuzz;
pub mod replay;

pub use bench::{Bench, BenchError, Given, Output, Setup};
