//! What a lane sends back between two scans, besides records: everything in it is dropped off the lane.

use super::exchange::{Exchange, Exchanged};
use std::collections::VecDeque;

/// An answer or a message of a lane; each part of the plant has its variant.
pub enum Report {
    /// The state of a block that was wanted.
    Saved(super::SaveAnswer),
    /// Other versions of some blocks execute now.
    Exchanged(Box<Exchanged>),
    /// An exchange has ended, one way or the other.
    SwapEnded(Box<Exchange>),
    /// A tap that has ended, to be dropped.
    Tap(Box<super::Tap>),
}

/// What found no room yet, in the order in which it was sent. It does not allocate as long as what waits fits.
pub(super) struct Unsent<T>(VecDeque<T>);

impl<T> Unsent<T> {
    /// With room for so many.
    pub(super) fn new(room: usize) -> Self {
        Self(VecDeque::with_capacity(room))
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Sends something, behind all that waits.
    pub(super) fn send(&mut self, to: &mut rtrb::Producer<T>, report: T) {
        if !self.0.is_empty() {
            return self.0.push_back(report);
        }
        if let Err(rtrb::PushError::Full(report)) = to.push(report) {
            self.0.push_back(report);
        }
    }

    /// Sends what waits as far as there is room.
    pub(super) fn send_again(&mut self, to: &mut rtrb::Producer<T>) {
        while to.slots() > 0
            && let Some(report) = self.0.pop_front()
        {
            // There is room, and this is the only producer.
            let _ = to.push(report);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_found_no_room_is_not_overtaken() {
        let (mut to, mut from) = rtrb::RingBuffer::new(2);
        let mut unsent = Unsent::new(8);
        (0..6).for_each(|n| unsent.send(&mut to, n));
        let mut got = vec![from.pop().expect("the first")];
        // There is room again, but older ones wait.
        unsent.send(&mut to, 6);
        while !unsent.is_empty() {
            unsent.send_again(&mut to);
            got.extend(std::iter::from_fn(|| from.pop().ok()));
        }
        assert_eq!(got, [0, 1, 2, 3, 4, 5, 6]);
    }
}
