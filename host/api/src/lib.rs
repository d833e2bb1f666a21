//! A running plant over a local socket: HTTP with JSON.
//!
//! Owns the Unix socket and who may do what through it, the routes and their document, and the client that the command line
//! uses. It must never know what an operation does: that is the plant's ([`latchwork_plant::operate`]). It runs on one thread of
//! its own, off the lanes.
//!
//! ```text
//! client ──HTTP over a Unix socket──► connection (who is it? the kernel says) ──► route ──► gate (policy) ──► Console ──► plant
//!                                                                                  └─► records: from the journal on disk
//! ```
#![forbid(unsafe_code)]

pub mod client;
mod connections;
mod error;
mod gate;
mod peer;
mod reply;
mod request;
mod routes;
mod server;
mod socket;
mod upload;

pub use error::ApiError;
pub use server::{Config, Limits, Server};

/// What every route is, as an OpenAPI 3.1 document; the server gives it at `/openapi.json`.
pub const OPENAPI: &str = include_str!("../../../docs/openapi.json");

/// Header with which a client says where a wish comes from: `cli`, `script`, `panel` or `api`.
pub const ORIGIN: &str = "latchwork-origin";
