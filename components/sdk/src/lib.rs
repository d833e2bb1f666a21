//! Write a Latchwork function block in Rust: a struct, and one impl with `#[block]`.
//!
//! ```
//! #[derive(Default)]
//! struct Rising {
//!     clk: bool,
//! }
//!
//! #[latchwork_sdk::block("latchwork:device/r-trig")]
//! impl Rising {
//!     fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
//!         let q = inputs.clk && !self.clk;
//!         self.clk = inputs.clk;
//!         Outputs { q }
//!     }
//!     fn save(&self) -> Retained {
//!         Retained { clk: self.clk }
//!     }
//!     fn restore(&mut self, state: Retained) {
//!         self.clk = state.clk;
//!     }
//! }
//! # fn main() {}
//! ```
#![no_std]

extern crate alloc;
// Native builds (unit tests of blocks) get their panic handler from std.
#[cfg(not(target_arch = "wasm32"))]
extern crate std;
// Generated code names this crate by its name, here too.
extern crate self as latchwork_sdk;

pub mod log;
#[cfg(all(target_arch = "wasm32", feature = "rt"))]
mod freestanding;
#[doc(hidden)]
pub mod rt;
pub mod types;

#[allow(warnings, reason = "written by wit-bindgen")]
mod bindings {
    latchwork_sdk_macros::__shared!();
}

pub use alloc::{format, string::String, vec, vec::Vec};
pub use latchwork_sdk_macros::block;
