//! Write a Latchwork function block in Rust: a struct, and one impl with `#[block]`.
//!
//! ```
//! #[derive(Default)]
//! struct Rising {
//!     m: bool,
//! }
//!
//! #[latchwork_sdk::block("latchwork:device/r-trig")]
//! impl Rising {
//!     fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
//!         let q = inputs.clk && !self.m;
//!         self.m = inputs.clk;
//!         Outputs { q }
//!     }
//!     fn save(&self) -> Retained {
//!         Retained { m: self.m }
//!     }
//!     fn restore(&mut self, state: Retained) {
//!         self.m = state.m;
//!     }
//! }
//! # fn main() {}
//! ```
//! The class is one of Latchwork's (`wit/device` of the project), or one of a WIT package of your own in a folder beside
//! your Cargo.toml: `#[block("workshop:drives/conveyor", wit = "wit")]`. That package may use `latchwork:block/types`
//! without a copy of it.
//!
//! # What an impl has
//!
//! | function | when the class has | as |
//! |---|---|---|
//! | `execute` | always | `fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms)` |
//! | `defaults` | `defaults` | `fn defaults() -> Settings` |
//! | `configure` | `settings` | `fn configure(&mut self, settings: Settings) -> Result<(), String>` |
//! | `save`, `restore` | `retained` | `fn save(&self) -> Retained`, `fn restore(&mut self, state: Retained)` |
//!
//! What the class lacks is absent: without alarms `execute` returns `Outputs`. The error of `configure` may be anything
//! with `Display`; it refuses the settings, and an operator reads it. Anything else wrong is a message of the compiler at
//! the place. A component has one instance of its block, made by `Default` at the first call:
//!
//! ```compile_fail,E0277
//! struct Rising { m: bool } // no Default
//! # #[latchwork_sdk::block("latchwork:device/r-trig")]
//! # impl Rising {
//! #     fn execute(&mut self, _: Scan, inputs: Inputs) -> Outputs { Outputs { q: inputs.clk } }
//! #     fn save(&self) -> Retained { Retained { m: self.m } }
//! #     fn restore(&mut self, _: Retained) {}
//! # }
//! # fn main() {}
//! ```
//!
//! # Names in scope
//!
//! In the module of the impl: the types of the class (`Inputs`, `Outputs`, …, its enums and flags, each with `Default`:
//! zeros, no flags, the first case) and those of [`types`] that it uses. Names of WIT become names of Rust:
//! `feedback-timeout` is `feedback_timeout`, the flag `miss-starting` is `Alarms::MISS_STARTING`, a keyword gets an
//! underscore (`in_`). Two blocks in one component: a module for each.
//!
//! # With or without std
//!
//! A block with `#![no_std]` is the smallest: this crate gives it an allocator and a panic handler ([`vec!`], [`format!`],
//! [`String`] and [`Vec`] are here). A block that wants `std` depends on this crate with `default-features = false`;
//! otherwise the linker finds two panic handlers ("duplicate lang item `panic_impl`"). Compiled for the machine at hand
//! (`cargo test`), a block is a plain struct with plain methods.
#![no_std]

extern crate alloc;
// Native builds (unit tests of blocks) get their panic handler from std.
#[cfg(not(target_arch = "wasm32"))]
extern crate std;
// Generated code names this crate by its name, here too.
extern crate self as latchwork_sdk;

#[cfg(all(target_arch = "wasm32", feature = "rt"))]
mod freestanding;
pub mod log;
#[doc(hidden)]
pub mod rt;
pub mod types;

#[allow(warnings, reason = "written by wit-bindgen")]
mod bindings {
    latchwork_sdk_macros::__shared!();
}

pub use alloc::{format, string::String, vec, vec::Vec};
pub use latchwork_sdk_macros::block;

/// The flags whose condition holds, one row per flag: `flags([(Alarms::HIGH, is_high), (Alarms::LOW, is_low)])`. For alarms
/// and status registers, and for any other type of flags.
pub fn flags<T: FromIterator<T>, const N: usize>(all: [(T, bool); N]) -> T {
    all.into_iter().filter(|(_, holds)| *holds).map(|(flag, _)| flag).collect()
}
