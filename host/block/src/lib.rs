//! Function blocks that are WebAssembly components: load, inspect, check, execute, limit, save and restore.
//!
//! Owns the engine, the device class as it is read from a component, the two call paths and the cache of compiled code.
//! It must never know of plants, lanes, drivers or files other than components and its own cache; it reads no clock.
//!
//! ```text
//! bytes ─► Component ─► Class (ports, from the component's types)
//!             └───────► Template (compiled; plain path, or component path and why) ─► Instance ─► execute(cells)
//! ```
//!
//! Every instance lives in a store of its own, so a fault poisons nothing else. A faulted instance is discarded.

mod cache;
mod class;
mod compile;
mod component;
mod component_path;
mod engine;
mod error;
mod fault;
mod instance;
mod interface;
mod limits;
mod log;
mod plain;
mod state;
pub mod upgrade;

pub use class::{Class, Port};
pub use compile::compile;
pub use component::{CallPath, Component, Template};
pub use engine::{Engine, EngineError, EngineOptions, Ticker};
pub use error::LoadError;
pub use fault::{Fault, FaultKind};
pub use instance::{Instance, Scan};
pub use limits::Limits;
pub use log::Level;
