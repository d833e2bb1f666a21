//! Drivers: the way between the plant's points and the process image.
//!
//! Owns the driver trait, the registry of driver kinds, the drivers themselves, the thread they run on and the reader
//! of stimulus files. A driver is the only writer of its input region and reads the tags its output points name. It
//! runs on the I/O thread, never in a lane, and must never know of blocks, lanes or the plant file as a whole.
//!
//! ```text
//! field device ◄──requests──► Driver (on IoThread) ──publish──► its region ──► lanes
//!                               ▲        └──IoEvent──► records
//!                               └── Outputs: what the output points show, or `Safe`
//! ```
#![forbid(unsafe_code)]

mod backoff;
mod cycle;
pub mod direct;
pub mod driver;
mod edges;
pub mod gpio;
pub mod kinds;
mod modbus;
mod rppal;
pub mod sim;
pub mod stimulus;
mod thread;

pub use thread::IoThread;
