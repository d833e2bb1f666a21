//! The process image: what lanes, drivers and operators share.
//!
//! Owns the types a tag can have, the values they hold, the table of tags, the regions they live in and the
//! table of forces. Every region has one writer; readers take consistent snapshots without ever making it wait.
//! It must never know of WebAssembly, of I/O, of threads or of a clock: time comes in as an argument.
//!
//! ```text
//! writer (driver, lane, operators) ──publish(cells, time)──► Region ◄──snapshot── reader (lane, driver, display)
//!         ▲ forces (ForceInbox)                                 ▲
//!         └──────────── ForceBoard ◄── operators       TagTable: name → region, slot, bit, quality
//! ```
#![forbid(unsafe_code)]

mod force;
mod quality;
mod region;
mod tag;
mod text;
mod time;
mod types;
mod value;
mod view;

pub use force::{ForceBoard, ForceError, ForceInbox, Forced};
pub use quality::Quality;
pub use region::{RegionReader, RegionWriter, region};
pub use tag::{Location, Resolved, Source, Tag, TagError, TagId, TagTable, nearest};
pub use text::plain;
pub use time::{DurationError, format_duration, parse_duration};
pub use types::{ParseValueError, Type};
pub use value::Value;
pub use view::View;
