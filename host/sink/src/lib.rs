//! Loggers that the records of a plant go to: files, brokers, system logs, components.
//!
//! Owns the interface of a sink, the kinds there are, and the thread that takes each sink through the journal from its own
//! stored cursor. It must never know what a lane, a block or an alarm rule is: it reads records.
//!
//! ```text
//! Journal ──durable()──► runner, a thread per sink ──batch──► Sink::write ──highest number kept──► cursor, stored
//! ```
#![forbid(unsafe_code)]

mod component;
mod exchange;
mod feed;
mod keys;
pub mod kinds;
mod prepare;
mod runner;
mod sink;
mod status;
mod worker;

pub use component::{COMPONENT, Version};
pub use exchange::{Exchange, Phase, Swapper};
pub use keys::{KEYS, check};
pub use prepare::Preparation;
pub use runner::{Report, Runner, What};
pub use sink::{Claim, Config, Problem, Sink, SinkKind};
pub use status::{State, Status, Statuses};
