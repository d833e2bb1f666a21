//! What the tests of this crate share: a generator of device classes and of guests, good and hostile ones.
#![allow(dead_code, reason = "every test binary uses another part of it")]
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub, reason = "not an interface")]

pub mod class;
pub mod component;
pub mod evil;
pub mod guest;
pub mod model;
pub mod shipped;
pub mod strategy;
pub mod twins;
