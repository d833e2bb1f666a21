//! Life of alarms: what a condition that comes and goes, and what operators do about it, make of an alarm.
//!
//! Owns the 16-bit configuration codes with their nine kinds, the state machine of one alarm, and a list of alarms with their
//! groups. All of it is pure: time is an argument, nothing is stored and nobody is told. It must never know what a lane, a
//! record or an operator's name is.
//!
//! ```text
//! condition ──► delay ──► active ─┐
//! acknowledge, reset ─────────────┼─► State ──► one Change per transition
//! shelf, suppression, service ────┘
//! ```
#![forbid(unsafe_code)]

mod code;
mod list;
mod machine;
pub mod report;

pub use code::{Code, CodeError, CodeKind};
pub use list::{Alarms, AlarmsError, Change};
pub use machine::{Alarm, Input, Refusal, Rules, State, Transition};
