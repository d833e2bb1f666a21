//! Declarative tables of the keys a TOML file may have.
//!
//! A section of the plant file is described once, as data. From that description come the check of a file (all errors
//! at once, with line and column), its JSON Schema for editors, and the reference page in docs/. Drivers describe
//! their own keys with the same tables, so a new driver needs no change here.
//! It must never know what a key means: only its name, its type, its range and its sentence.

pub mod check;
mod diagnostic;
mod finding;
mod json_schema;
mod key;
mod parse;
mod raw;
mod reference;
mod typed;
mod values;
mod words;

pub use check::{Checker, Entry};
pub use diagnostic::{findings_json, position, render};
pub use finding::{Finding, Severity};
pub use json_schema::json_schema;
pub use key::{Key, Kind, Section};
pub use reference::reference;
pub use typed::{cell, has_words, near_word};
pub use values::{Constant, Span, Value, Values};
pub use words::{format_size, parse_size};
