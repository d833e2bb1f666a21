//! What a lane sends back between two scans, besides records: everything in it is dropped off the lane.

/// An answer or a message of a lane; each part of the plant has its variant.
pub enum Report {
    /// A tap that has ended, to be dropped.
    Tap(Box<super::Tap>),
}
