//! Records: what a plant tells about itself, from the lane that notices it to the file that keeps it.
//!
//! Owns the entry a lane pushes without allocating, the bounded queue it goes through, the router that orders entries
//! of all queues by time and numbers them, the journal that keeps them on disk, and the JSON form of a record. It must never
//! know what a block, a driver or an alarm rule is: sources are names, values are plain.
//!
//! ```text
//! lane ──Entry──► Queue (bounded, lock-free) ─┐
//! lane ──Entry──► Queue ──────────────────────┼─► Router: order by time, number ──Record──► files, displays, sinks
//! driver, operator ──► Queue ─────────────────┘
//! ```
#![forbid(unsafe_code)]

mod entry;
pub mod journal;
mod queue;
mod record;
mod router;

pub use entry::{Datum, Entry, Kind, SourceId, TEXT_BYTES, Text};
pub use queue::{Recorder, queue};
pub use record::{Draft, Kept, Record, rfc3339};
pub use router::{Incoming, Router, Turn};
