//! Recordings of what blocks got and gave: their format, and running them again.
//!
//! ```text
//! events ─Writer─► Segment ─chunk─► file or folder ─Recording─► replay ─► Replayed (equal bit for bit, or the differences)
//! ```

mod bytes;
mod compare;
mod events;
mod export;
mod file;
mod grounds;
mod player;
mod recording;
mod report;
mod run;
mod segment;
mod tolerances;

pub use compare::Comparer;
pub use events::{Decoder, Encoder, Event, Shape};
pub use export::{Exported, export};
pub use file::{ENDING, RecordingError, VERSION, component_chunk, components_of, header, segment_chunk};
pub use recording::{Recording, hash_of};
pub use report::{Deviation, FailedRun, Other, Replayed, named};
pub use run::{Options, ReplayError, replay};
pub use segment::{Head, Segment, Start, Writer};
pub use tolerances::{ToleranceError, Tolerances};

/// What is wrong with a part of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Damaged(pub(crate) &'static str);
