//! What a lane sends back between two scans, besides records: everything in it is dropped off the lane.

use super::exchange::{Exchange, Exchanged};

/// An answer or a message of a lane; each part of the plant has its variant.
pub enum Report {
    /// Other versions of some blocks execute now.
    Exchanged(Box<Exchanged>),
    /// An exchange has ended, one way or the other.
    SwapEnded(Box<Exchange>),
    /// A tap that has ended, to be dropped.
    Tap(Box<super::Tap>),
}
