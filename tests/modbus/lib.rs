//! The Modbus drivers against pymodbus, a foreign implementation: see `tests/`.
