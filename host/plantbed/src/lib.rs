//! Whole plants under test: test files with `plant = "plant.toml"`, at virtual time.
//!
//! Owns what such a file may say of a plant, and how its cases run. It must never know of terminals or command lines; the
//! runtime of the plant is the one that controls real ones.
//!
//! ```text
//! FILE.test.toml ─check_file─► Checked ─► Tests::Plant (steps of operations on tags) ─run─► CaseReport
//!                                  └────► Tests::Component (`component = …`, see latchwork_testbed::case)
//! ```
//!
//! A case starts the plant anew, as `latchwork run --sim --speed max` does. At the time of a step its inputs change and its
//! wishes are brought as an operator brings them; then everything happens that is due up to this time; then what is expected
//! is compared.

mod columns;
mod file;
pub mod keys;
mod model;
mod operations;
mod read;
mod run;
mod steps;
mod subject;
mod swaps;
mod tags;
mod verdict;
mod world;

pub use file::{Checked, Tests, check_file, check_text};
pub use model::{Case, PlantTest};
