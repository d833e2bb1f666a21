//! The files: segments one after another, a new file at every sixteenth of the room, the oldest deleted.
//!
//! A thread of its own writes ([`Writer`]), because a disk may take its time. Whoever orders never waits for it in real time:
//! what it cannot keep up with is left out and said, once when that begins and once when it is over.

use super::writer::Writer;
use std::collections::{BTreeSet, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, channel, sync_channel};
use std::thread::JoinHandle;
use std::time::Instant;

/// Segments that may wait for the disk.
const WAITING: usize = 1024;

/// What is to be written.
pub(super) enum Order {
    /// A segment of the component with this hash.
    Segment(String, Vec<u8>),
    /// A component and its hash.
    Component(String, Vec<u8>),
    /// Hashes of the components whose segments may still come.
    InUse(BTreeSet<String>),
    /// All that was ordered is to be on the disk as soon as it can.
    Sync,
}

/// What the writer says of the disk.
pub(super) enum Trouble {
    /// It refuses: why.
    Refused(String),
    /// It takes everything again; so many segments were left out.
    Accepted(u64),
}

/// What is told of the files.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Told {
    /// From now on segments are missing: why.
    NotWritten(String),
    /// It is over; so many are missing.
    Written(u64),
}

/// The way to the disk.
pub(super) struct Spill {
    orders: Option<SyncSender<Order>>,
    thread: Option<JoinHandle<()>>,
    trouble: Receiver<Trouble>,
    run: u64,
    /// Orders given, and those that the writer is done with.
    given: u64,
    done: Arc<AtomicU64>,
    /// What must not be left out, while it finds no room.
    unsent: VecDeque<Order>,
    /// The disk refuses.
    refused: bool,
    /// It is too slow: there was no room for a segment, and it is not done with all orders yet.
    slow: bool,
    /// What is left out.
    loss: Option<Loss>,
}

#[derive(Default)]
struct Loss {
    segments: u64,
    why: Option<String>,
    told: bool,
}

impl Spill {
    /// Into a folder, which is made; at most `room` bytes of segments.
    pub(super) fn open(folder: &Path, room: u64) -> std::io::Result<Self> {
        std::fs::create_dir_all(folder)?;
        let (told, trouble) = channel();
        let writer = Writer::new(folder, room, told)?;
        let run = writer.run();
        let (mut spill, incoming) = Self::to(trouble, run);
        let done = Arc::clone(&spill.done);
        let work = move || {
            let mut writer = writer;
            for order in incoming {
                writer.take(order, Instant::now());
                done.fetch_add(1, Ordering::Release);
            }
            writer.end();
        };
        spill.thread = Some(std::thread::Builder::new().name("recorder".into()).spawn(work)?);
        Ok(spill)
    }

    /// The end of the plant, and that of whoever writes.
    fn to(trouble: Receiver<Trouble>, run: u64) -> (Self, Receiver<Order>) {
        let (orders, incoming) = sync_channel(WAITING);
        let spill = Self {
            orders: Some(orders),
            thread: None,
            trouble,
            run,
            given: 0,
            done: Arc::default(),
            unsent: VecDeque::new(),
            refused: false,
            slow: false,
            loss: None,
        };
        (spill, incoming)
    }

    /// Number of this run among those in the folder.
    pub(super) fn run(&self) -> u64 {
        self.run
    }

    /// Orders something. Without `waiting` a segment that finds no room is left out; the rest is ordered later.
    pub(super) fn order(&mut self, order: Order, waiting: bool) {
        self.order_unsent(waiting);
        match self.give(order, waiting) {
            None => {}
            Some(Order::Segment(..)) => {
                self.slow = true;
                self.loss.get_or_insert_default().segments += 1;
            }
            Some(Order::Sync) if self.unsent.iter().any(|o| matches!(o, Order::Sync)) => {}
            Some(order) => self.unsent.push_back(order),
        }
    }

    fn order_unsent(&mut self, waiting: bool) {
        while let Some(order) = self.unsent.pop_front() {
            if let Some(order) = self.give(order, waiting) {
                return self.unsent.push_front(order);
            }
        }
    }

    /// Gives it back when there is no room.
    fn give(&mut self, order: Order, waiting: bool) -> Option<Order> {
        let orders = self.orders.as_ref()?;
        let given = if waiting {
            orders.send(order).is_ok()
        } else {
            match orders.try_send(order) {
                Err(TrySendError::Full(order)) => return Some(order),
                // A writer that has panicked takes nothing any more, which its panic has told.
                other => other.is_ok(),
            }
        };
        self.given += u64::from(given);
        None
    }

    /// What there is to be told of the files since it was asked last.
    pub(super) fn told(&mut self) -> Vec<Told> {
        self.order_unsent(false);
        let mut told = Vec::new();
        while let Ok(trouble) = self.trouble.try_recv() {
            let loss = self.loss.get_or_insert_default();
            match trouble {
                Trouble::Refused(why) => (self.refused, loss.why) = (true, Some(why)),
                Trouble::Accepted(segments) => {
                    self.refused = false;
                    loss.segments += segments;
                }
            }
        }
        // It has kept up when it is done with everything.
        self.slow &= self.done.load(Ordering::Acquire) != self.given || !self.unsent.is_empty();
        let over = !self.refused && !self.slow;
        if let Some(loss) = &mut self.loss {
            if !std::mem::replace(&mut loss.told, true) {
                told.push(Told::NotWritten(loss.why.take().unwrap_or_else(|| "the disk is too slow".into())));
            }
            if over {
                told.push(Told::Written(loss.segments));
                self.loss = None;
            }
        }
        told
    }
}

impl Drop for Spill {
    /// Waits for the disk: the plant has stopped.
    fn drop(&mut self) {
        if self.thread.is_some() {
            self.order_unsent(true);
        }
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // A panic has been told by itself.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(n: usize) -> Order {
        Order::Segment("c".into(), vec![n as u8])
    }

    #[test]
    fn a_disk_that_does_nothing_holds_nobody_up_and_is_told_once_when_it_begins_and_once_when_it_ends() {
        let (_refuses, trouble) = channel();
        let (mut spill, disk) = Spill::to(trouble, 1);
        let mut told = Vec::new();
        for n in 0..WAITING + 100 {
            spill.order(segment(n), false);
            told.extend(spill.told());
        }
        // What other segments need is not left out.
        spill.order(Order::Component("c".into(), vec![1]), false);
        spill.order(Order::Sync, false);
        spill.order(Order::Sync, false);
        assert_eq!(told, [Told::NotWritten("the disk is too slow".into())]);
        // It wakes up.
        let (mut segments, mut others) = (0, 0);
        while let Ok(order) = disk.try_recv() {
            if matches!(order, Order::Segment(..)) {
                segments += 1
            } else {
                others += 1
            }
            spill.done.fetch_add(1, Ordering::Release);
            told.extend(spill.told());
        }
        assert_eq!((segments, others), (WAITING, 2));
        assert_eq!(told[1..], [Told::Written(100)]);
        assert_eq!(spill.told(), []);
    }

    #[test]
    fn a_disk_that_refuses_is_told_in_the_same_way() {
        let (disk, trouble) = channel();
        let (mut spill, _orders) = Spill::to(trouble, 1);
        disk.send(Trouble::Refused("full".into())).expect("somebody listens");
        assert_eq!(spill.told(), [Told::NotWritten("full".into())]);
        assert_eq!(spill.told(), []);
        disk.send(Trouble::Accepted(7)).expect("somebody listens");
        disk.send(Trouble::Refused("full again".into())).expect("somebody listens");
        assert_eq!(spill.told(), [], "it was not over");
        disk.send(Trouble::Accepted(3)).expect("somebody listens");
        assert_eq!(spill.told(), [Told::Written(10)]);
    }
}
