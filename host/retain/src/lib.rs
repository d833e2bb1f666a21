//! Retained state on disk: what blocks have saved, written so that a power cut at any moment leaves the last or the last
//! but one.
//!
//! Owns the two files, their format and the thread that writes them. It must never know what a block, a plant or a type is:
//! names, classes and schemas are texts, state is cells.
//!
//! ```text
//! plant ──Retained──► Store ─(own thread)─► slot 0 │ slot 1, in turn, whole, with checksum ─► at start: the newer sound one
//! ```
#![forbid(unsafe_code)]

mod retained;
mod slot;
mod slots;
mod store;
mod vault;

pub use retained::{Retained, Saved, Version};
pub use slot::{BLOCK, Damage, LONGEST, decode, encode};
pub use slots::{FILES, Found, read};
pub use store::{OpenError, Store};
pub use vault::{Figures, Memory, Trouble, Vault};
