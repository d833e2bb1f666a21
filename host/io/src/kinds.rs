//! All kinds of drivers, one line each.

use crate::driver::DriverKind;

/// The kinds a plant file may name.
pub const KINDS: &[&DriverKind] =
    &[&crate::sim::SIM, &crate::gpio::GPIO, &crate::modbus::TCP, &crate::modbus::RTU, &crate::rppal::RPPAL];

/// The kind of a name.
pub fn find(name: &str) -> Option<&'static DriverKind> {
    KINDS.iter().copied().find(|k| k.name == name)
}
