//! The thread that writes: batches, each one transaction.

use super::Notice;
use super::store::{Item, Store, WriteError};
use super::watch::Watch;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

/// Items of one transaction at most.
const BATCH: usize = 16_384;
/// Longest wait for a first record: cursors that moved meanwhile are written then, and what is too old goes.
const IDLE: Duration = Duration::from_secs(1);
/// Pause before a batch that was refused is offered again.
const PAUSE: Duration = Duration::from_millis(250);
/// How often a batch that is refused is offered again once the plant has ended.
const LAST_TRIES: usize = 8;

/// The receiving end of the queue.
pub(super) struct Items {
    pub(super) receiver: Receiver<Item>,
    /// How many wait in it.
    pub(super) waiting: Arc<AtomicUsize>,
}

impl Items {
    fn next(&self, end: Instant) -> Result<Item, RecvTimeoutError> {
        let item = self.receiver.recv_timeout(end.saturating_duration_since(Instant::now()))?;
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        Ok(item)
    }
}

/// Writes until no more will come; how many records it could not write.
pub(super) fn run(mut store: Store, items: &Items, within: Duration, watch: &Watch, tell: &Sender<Notice>) -> u64 {
    let mut batch = Vec::new();
    let mut cursors = BTreeMap::new();
    let (mut refused, mut more_to_drop) = (false, false);
    let mut tries = 0;
    // Nobody listens any more at the end: what is told then was not worth waiting for.
    let say = |notice| drop(tell.send(notice));
    store.untold().into_iter().for_each(|(sink, count)| say(Notice::Dropped { sink, count }));
    loop {
        let idle = if more_to_drop { Duration::ZERO } else { IDLE };
        let open = gather(items, &mut batch, if refused { Duration::ZERO } else { within }, idle);
        // They cost no write of their own while records come, and one a second otherwise.
        cursors.extend(watch.take_cursors());
        if batch.is_empty() && cursors.is_empty() {
            if !open {
                return 0;
            }
        } else {
            match store.write(&batch, &cursors) {
                Ok(()) => {
                    if let Some(last) = batch.iter().rev().find_map(|i| i.record.as_ref()) {
                        watch.committed(last.seq);
                    }
                    batch.clear();
                    cursors.clear();
                    if std::mem::take(&mut refused) {
                        say(Notice::Accepted);
                    }
                }
                Err(error) => failed(&mut store, error, &mut refused, watch, tell),
            }
        }
        if open {
            match store.retain() {
                Ok(step) => {
                    more_to_drop = step.more;
                    step.tell.into_iter().for_each(|(sink, count)| say(Notice::Dropped { sink, count }));
                }
                Err(error) => failed(&mut store, error, &mut refused, watch, tell),
            }
        } else if !batch.is_empty() {
            tries += 1;
            if tries >= LAST_TRIES {
                let left = batch.iter().filter(|i| i.record.is_some()).count();
                return (left + items.waiting.load(Ordering::Relaxed)) as u64;
            }
        } else if cursors.is_empty() && items.waiting.load(Ordering::Relaxed) == 0 {
            return 0;
        }
    }
}

fn failed(store: &mut Store, error: WriteError, refused: &mut bool, watch: &Watch, tell: &Sender<Notice>) {
    match error {
        WriteError::Damaged(why) => match store.begin_anew() {
            Ok(aside) => {
                watch.begun_anew();
                // Nobody listens any more at the end.
                let _ = tell.send(Notice::SetAside(aside));
            }
            Err(error) => pause(refused, tell, &format!("{why}; {error}")),
        },
        WriteError::Refused(why) => pause(refused, tell, &why),
    }
}

fn pause(refused: &mut bool, tell: &Sender<Notice>, why: &str) {
    if !std::mem::replace(refused, true) {
        let _ = tell.send(Notice::Refused(why.to_owned()));
    }
    std::thread::sleep(PAUSE);
}

/// Takes items until the first of them has waited long enough, or the batch is full; waits for a first one for `idle`. False
/// when no more will come.
fn gather(items: &Items, batch: &mut Vec<Item>, within: Duration, idle: Duration) -> bool {
    if batch.is_empty() {
        match items.next(Instant::now() + idle) {
            Ok(item) => batch.push(item),
            Err(RecvTimeoutError::Timeout) => return true,
            Err(RecvTimeoutError::Disconnected) => return false,
        }
    }
    let end = Instant::now() + within;
    while batch.len() < BATCH {
        match items.next(end) {
            Ok(item) => batch.push(item),
            Err(RecvTimeoutError::Timeout) => return true,
            Err(RecvTimeoutError::Disconnected) => return false,
        }
    }
    true
}
