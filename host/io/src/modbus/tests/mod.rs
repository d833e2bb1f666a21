//! Behaviour of the driver against a device in memory, in virtual time: every run is the same.

mod bench;
mod device;
mod faults;
mod problems;
mod reading;
mod writing;
