//! Projects of block authors: what `latchwork new` writes, and what `latchwork build` makes of it.
//!
//! ```text
//! class (WIT) ──► Class ──► lang::*  ──► files of a project            new
//! project ──► the language's own tool ──► core module ──► component    build
//! ```
//!
//! Owns the templates of every language, the glue between a language's structs and the canonical ABI, the stand-in for WASI
//! and the way from a core module to a component. It must never know of plants, lanes or engines: what it builds is looked at
//! by others (`inspect`, `test`).

mod abi;
mod build;
mod class;
mod component;
mod error;
pub mod lang;
mod manifest;
mod names;
mod project;
mod sample;
mod tools;
mod wit;

pub use build::{Built, build, built_before};
pub use component::WASI_STUB;
pub use error::AuthorError;
pub use lang::Language;
pub use manifest::{Manifest, Step};
pub use project::{ClassChoice, Project, create, free};
pub use wit::shipped_classes;
