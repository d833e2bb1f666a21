//! `latchwork doctor`: how ready a machine is for real-time control, and the line that mends each shortcoming.
//!
//! Owns the checks, one file per group. A check is a function of a [`Machine`] (files below a folder, and a few values that
//! were found out beforehand) and of what a plant [`Needs`]; it changes nothing and asks nobody else. So every machine can
//! be a table in a test.

mod access;
mod boot;
mod cache;
mod cpu;
mod finding;
mod gpio;
mod kernel;
mod lanes;
mod lines;
mod machine;
mod memory;
mod needs;
mod numbers;
mod power;
mod realtime;
mod report;
mod serial;
#[cfg(test)]
mod tests;
mod watchdog;

pub(crate) use finding::{Finding, Status};
pub(crate) use machine::{Cache, Machine};
pub(crate) use needs::{LaneKind, LaneNeeds, LineName, LineNeeds, Needs};
pub(crate) use report::{json, text};

type Check = fn(&Machine, Option<&Needs>) -> Vec<Finding>;

/// Groups of checks, in the order of the report: what stops a plant from being on time first.
const GROUPS: [(&str, &[Check]); 6] = [
    ("Real time", &[realtime::priority, realtime::throttling, memory::lock]),
    ("Kernel", &[kernel::preemption, kernel::clock_source, kernel::virtual_machine]),
    ("Processors", &[cpu::governor, cpu::isolation, cpu::idle, power::supply]),
    ("Memory", &[memory::swap, memory::huge_pages, cache::folder]),
    ("Devices", &[gpio::chips, gpio::registers, lines::holders, watchdog::device, serial::ports]),
    ("Lanes", &[lanes::cpus, lanes::sharing, lanes::priorities]),
];

/// Examines a machine, for one plant or in general. Groups without findings are left out.
pub(crate) fn examine(machine: &Machine, needs: Option<&Needs>) -> Vec<(&'static str, Vec<Finding>)> {
    GROUPS
        .into_iter()
        .map(|(group, checks)| (group, checks.iter().flat_map(|check| check(machine, needs)).collect::<Vec<_>>()))
        .filter(|(_, findings)| !findings.is_empty())
        .collect()
}
