//! What others see of a journal while it is written: how far it is safe, and where their cursors go.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A handle for whoever follows the journal from a thread of its own. Clones are the same handle.
#[derive(Clone, Default)]
pub struct Watch {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    journal: String,
    durable: AtomicU64,
    state: Mutex<State>,
    /// The number has risen, the file is another one, or somebody was woken.
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// Cursors that are not on the disk yet.
    cursors: BTreeMap<String, u64>,
    /// How often the file was begun anew.
    files: u64,
    /// What a reader of this file found damaged.
    damage: Option<String>,
}

impl Watch {
    pub(super) fn new(durable: u64, journal: &str) -> Self {
        let shared = Shared { journal: journal.into(), durable: AtomicU64::new(durable), ..Shared::default() };
        Self { shared: Arc::new(shared) }
    }

    /// Identity of the journal, see [`Opening::journal`](super::Opening::journal).
    pub fn journal(&self) -> &str {
        &self.shared.journal
    }

    /// The highest number for which it and all before are safe on disk.
    pub fn durable(&self) -> u64 {
        self.shared.durable.load(Ordering::Acquire)
    }

    /// Waits until a number above `after` is durable, `stop` is set and [`Watch::wake`] called, or the time is up; what is
    /// durable then.
    pub fn wait(&self, after: u64, timeout: Duration, stop: &AtomicBool) -> u64 {
        let end = Instant::now() + timeout;
        let mut state = self.state();
        loop {
            let (durable, left) = (self.durable(), end.saturating_duration_since(Instant::now()));
            if durable > after || left.is_zero() || stop.load(Ordering::Acquire) {
                return durable;
            }
            state = self.shared.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Makes everybody who waits look at the flag that ends it.
    pub fn wake(&self) {
        drop(self.state());
        self.shared.changed.notify_all();
    }

    /// Hands the cursor of a sink over: it has everything up to `seq`. On the disk within about a second, without a write of
    /// its own for each.
    pub fn moved(&self, sink: &str, seq: u64) {
        self.state().cursors.insert(sink.to_owned(), seq);
    }

    /// How often the file was begun anew since it was opened: readers of the one before read what is set aside.
    pub fn files(&self) -> u64 {
        self.state().files
    }

    /// A reader has met damage: why, and what [`Watch::files`] said before it opened its file. That file is set aside within
    /// about a second, and a new one begins.
    pub fn damaged(&self, files: u64, why: &str) {
        let mut state = self.state();
        if state.files == files {
            state.damage.get_or_insert_with(|| why.to_owned());
        }
    }

    /// Damage that nothing was done about yet.
    pub(super) fn take_damage(&self) -> Option<String> {
        self.state().damage.take()
    }

    pub(super) fn committed(&self, seq: u64) {
        let state = self.state();
        self.shared.durable.store(seq, Ordering::Release);
        drop(state);
        self.shared.changed.notify_all();
    }

    pub(super) fn begun_anew(&self) {
        let mut state = self.state();
        (state.files, state.damage) = (state.files + 1, None);
        drop(state);
        self.shared.changed.notify_all();
    }

    /// The cursors that have moved since the last call.
    pub(super) fn take_cursors(&self) -> BTreeMap<String, u64> {
        std::mem::take(&mut self.state().cursors)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // Nothing is half done in it at any moment.
        self.shared.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
