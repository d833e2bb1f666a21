//! Tests of the control logic, at virtual time: a table per rule of IEC 61131-3 or row of the alarm unit's
//! specification, then properties that hold on any input.

mod alarm_unit;
mod analog_veracity;
mod bounds;
mod counters;
mod digital_veracity;
mod flip_flops;
mod gate;
mod multivibrator;
mod properties;
mod refusals;
mod scale;
mod tank;
mod timers;

/// A millisecond in ns.
const MS: u64 = 1_000_000;
