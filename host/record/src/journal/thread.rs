//! The thread that writes: batches, each one transaction.

use super::Notice;
use super::store::{Store, WriteError};
use crate::Record;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

/// Records of one transaction at most.
const BATCH: usize = 16_384;
/// Longest wait for a first record; only then it waits anew.
const IDLE: Duration = Duration::from_secs(3600);
/// Pause before a batch that was refused is offered again.
const PAUSE: Duration = Duration::from_millis(250);
/// How often a batch that is refused is offered again once the plant has ended.
const LAST_TRIES: usize = 8;

/// The receiving end of the queue.
pub(super) struct Records {
    pub(super) receiver: Receiver<Record>,
    /// How many wait in it.
    pub(super) waiting: Arc<AtomicUsize>,
}

impl Records {
    fn next(&self, end: Instant) -> Result<Record, RecvTimeoutError> {
        let record = self.receiver.recv_timeout(end.saturating_duration_since(Instant::now()))?;
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        Ok(record)
    }
}

/// Writes until no more will come; how many it could not write.
pub(super) fn run(
    mut store: Store,
    records: &Records,
    within: Duration,
    durable: &AtomicU64,
    tell: &Sender<Notice>,
) -> u64 {
    let mut batch = Vec::new();
    let mut refused = false;
    let mut tries = 0;
    loop {
        let more = gather(records, &mut batch, if refused { Duration::ZERO } else { within });
        if batch.is_empty() {
            if more { continue } else { return 0 }
        }
        match store.write(&batch) {
            Ok(()) => {
                if let Some(last) = batch.last() {
                    durable.store(last.seq, Ordering::Release);
                }
                batch.clear();
                if std::mem::take(&mut refused) {
                    // Nobody listens any more at the end.
                    let _ = tell.send(Notice::Accepted);
                }
            }
            Err(WriteError::Damaged(why)) => match store.begin_anew() {
                Ok(aside) => {
                    let _ = tell.send(Notice::SetAside(aside));
                }
                Err(error) => pause(&mut refused, tell, &format!("{why}; {error}")),
            },
            Err(WriteError::Refused(why)) => pause(&mut refused, tell, &why),
        }
        if !more && !batch.is_empty() {
            tries += 1;
            if tries >= LAST_TRIES {
                return (batch.len() + records.waiting.load(Ordering::Relaxed)) as u64;
            }
        }
    }
}

fn pause(refused: &mut bool, tell: &Sender<Notice>, why: &str) {
    if !std::mem::replace(refused, true) {
        let _ = tell.send(Notice::Refused(why.to_owned()));
    }
    std::thread::sleep(PAUSE);
}

/// Takes records until the first of them has waited long enough, or the batch is full; false when no more will come.
fn gather(records: &Records, batch: &mut Vec<Record>, within: Duration) -> bool {
    while batch.is_empty() {
        match records.next(Instant::now() + IDLE) {
            Ok(record) => batch.push(record),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return false,
        }
    }
    let end = Instant::now() + within;
    while batch.len() < BATCH {
        match records.next(end) {
            Ok(record) => batch.push(record),
            Err(RecvTimeoutError::Timeout) => return true,
            Err(RecvTimeoutError::Disconnected) => return false,
        }
    }
    true
}
