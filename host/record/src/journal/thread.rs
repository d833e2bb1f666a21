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
        if let Some(why) = watch.take_damage() {
            failed(&mut store, WriteError::Damaged(why), &mut refused, tell);
        }
        let mut taken = true;
        if !batch.is_empty() || !cursors.is_empty() || store.is_to_begin() {
            match store.write(&batch, &cursors) {
                Ok(()) => {
                    if let Some(aside) = store.begun_anew() {
                        watch.begun_anew();
                        say(Notice::SetAside(aside));
                    }
                    if let Some(last) = batch.iter().rev().find_map(|i| i.record.as_ref()) {
                        watch.committed(last.seq);
                    }
                    batch.clear();
                    cursors.clear();
                    if std::mem::take(&mut refused) {
                        say(Notice::Accepted);
                    }
                }
                Err(error) => {
                    taken = false;
                    failed(&mut store, error, &mut refused, tell);
                }
            }
        }
        if open {
            match store.retain() {
                Ok(step) => {
                    more_to_drop = step.more;
                    step.tell.into_iter().for_each(|(sink, count)| say(Notice::Dropped { sink, count }));
                }
                Err(error) => failed(&mut store, error, &mut refused, tell),
            }
            continue;
        }
        tries += usize::from(!taken);
        let waiting = items.waiting.load(Ordering::Relaxed);
        if tries >= LAST_TRIES || taken && waiting == 0 {
            // Cursors that were not taken are those of the last run that could write.
            return (batch.iter().filter(|i| i.record.is_some()).count() + waiting) as u64;
        }
    }
}

fn failed(store: &mut Store, error: WriteError, refused: &mut bool, tell: &Sender<Notice>) {
    match error {
        // The next write begins a new one.
        WriteError::Damaged(why) => match store.set_aside() {
            Ok(()) => {}
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
