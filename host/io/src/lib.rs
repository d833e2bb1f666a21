//! Drivers: the way between the plant's points and the process image.
//!
//! Owns the driver trait, the registry of driver kinds and the drivers themselves. A driver is the only writer of its
//! input region and reads the tags its output points name. It runs on the I/O thread, never in a lane, and must never
//! know of blocks, lanes or the plant file as a whole.

pub mod driver;
pub mod kinds;
