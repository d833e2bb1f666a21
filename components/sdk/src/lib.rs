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
