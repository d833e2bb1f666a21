//! Modbus over TCP and over serial lines (RTU).
//!
//! | file | owns |
//! |---|---|
//! | `keys` | the keys of a driver and of a point, as users write them |
//! | `point` | what a point is: table, address, type; checks of all points together |
//! | `codec` | registers ↔ cells |
//! | `plan` | which requests a cycle makes |
//! | `transport` | a byte stream that refuses what nobody asked for |
//! | `link` | one request and its answer, checked and bounded in time |
//! | `connect` | ways to a peer: TCP, serial line |
//! | `session` | the cycle, losing and finding the peer, the stop |
//! | `inputs`, `outputs` | what was read and what is to be written |
//! | `health` | what is reported, and when it is not |

mod codec;
mod connect;
mod health;
mod inputs;
mod keys;
mod link;
mod outputs;
mod plan;
mod point;
mod session;
#[cfg(test)]
mod tests;
mod transport;

pub(crate) use keys::{RTU, TCP};
