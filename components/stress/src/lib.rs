//! A block made to misbehave in every way the host must survive, as a component.
//!
//! It owns the faults of `latchwork:device/stress`, done for real in wasm: nothing here is simulated. Native code has no
//! use for them, so the crate is empty there.
//!
//! It is the one block written without `#[block]`: safe bindings cannot return an enum case that does not exist, so
//! `execute` is exported by hand and spoils the bytes the bindings wrote.
#![cfg_attr(target_arch = "wasm32", no_std)]

#[cfg(target_arch = "wasm32")]
mod block;
#[cfg(target_arch = "wasm32")]
mod exports;
#[cfg(target_arch = "wasm32")]
mod faults;
