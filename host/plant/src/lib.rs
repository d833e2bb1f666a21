//! The plant: from the plant file to lanes that scan.
//!
//! Owns the plant file and its check, the layout of the process image, lanes and their faults, and the two ways to run:
//! by the machine's clock and at virtual time. It must never know of terminals, sockets or command lines.
//!
//! ```text
//! plant file ─check─► Model ─assemble─► Plant { lanes, drivers, sim, supervisor, router } ─run_real | run_virtual─► Outcome
//! ```

pub mod alarms;
pub mod assemble;
pub mod check;
mod file;
pub mod lane;
pub mod layout;
pub mod model;
pub mod operate;
mod recorder;
mod retain;
pub mod run;
pub mod schema;
pub mod sim;
mod supervision;
mod supervisor;
pub mod swap;
