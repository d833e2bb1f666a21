//! The thread that writes. The newest states count: older ones that still wait are left out.

use crate::slots::{Found, Slots};
use crate::{Figures, Retained, Trouble, Vault};
use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// After a writing that failed, the next try comes so much later.
const AGAIN: Duration = Duration::from_secs(5);

/// The files cannot be opened.
#[derive(Debug, thiserror::Error)]
#[error("the retained state in {} cannot be opened: {error}{}", folder.display(), hint(error))]
pub struct OpenError {
    /// Folder.
    pub folder: PathBuf,
    /// Why.
    pub error: io::Error,
}

fn hint(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::WouldBlock => "; another plant runs with this folder: give each its own",
        io::ErrorKind::PermissionDenied => "; the folder must belong to the user that the plant runs as",
        _ => "",
    }
}

struct Waiting {
    retained: Retained,
    round: bool,
}

#[derive(Default)]
struct Inner {
    waiting: Option<Waiting>,
    figures: Figures,
    troubles: VecDeque<Trouble>,
    /// Why the last writing failed.
    failing: Option<String>,
    closing: bool,
    /// The thread has ended.
    over: bool,
}

#[derive(Default)]
struct Shared {
    inner: Mutex<Inner>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Inner> {
        // It is whole between any two statements that could panic.
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The files with the thread that writes them.
pub struct Store {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// The plant's end of a store.
struct Handle {
    shared: Arc<Shared>,
}

impl Store {
    /// Opens the files in a folder, which must be there; the thread waits for states.
    ///
    /// # Errors
    /// Files that cannot be opened or made, or that another plant holds. Damaged ones are no error.
    pub fn open(folder: &Path) -> Result<(Self, Found), OpenError> {
        let failed = |error| OpenError { folder: folder.into(), error };
        let (mut slots, mut found) = Slots::open(folder).map_err(failed)?;
        if found.lost() {
            slots.set_aside(&mut found);
        }
        let shared = Arc::new(Shared::default());
        let at = Arc::clone(&shared);
        let body = move || run(&at, &mut slots);
        let thread = std::thread::Builder::new().name("retain".into()).spawn(body).map_err(failed)?;
        Ok((Self { shared, thread: Some(thread) }, found))
    }

    /// The plant's end.
    pub fn vault(&self) -> Box<dyn Vault> {
        Box::new(Handle { shared: Arc::clone(&self.shared) })
    }

    /// What was written so far.
    pub fn figures(&self) -> Figures {
        self.shared.lock().figures
    }

    /// Writes what still waits, at most for so long, and ends the thread.
    ///
    /// # Errors
    /// A sentence: what waited is not durable.
    pub fn close(mut self, limit: Duration) -> Result<Figures, String> {
        let end = Instant::now() + limit;
        let mut inner = self.shared.lock();
        inner.closing = true;
        self.shared.changed.notify_all();
        while !inner.over {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                // The thread hangs in the kernel; it ends with the process.
                self.thread = None;
                return Err(format!("the retained state was not written within {} s", limit.as_secs_f32()));
            }
            let waited = self.shared.changed.wait_timeout(inner, left);
            inner = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        let left_out = inner.waiting.is_some();
        match &inner.failing {
            Some(why) if left_out => Err(format!("the last retained state was not written: {why}")),
            _ => Ok(inner.figures),
        }
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        self.shared.lock().closing = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // It never panics with the files half written: they are written by one call.
            let _ = thread.join();
        }
    }
}

impl Vault for Handle {
    fn keep(&mut self, retained: Option<Retained>, round: bool) {
        let mut inner = self.shared.lock();
        inner.figures.rounds += u64::from(round);
        if let Some(retained) = retained {
            inner.waiting = Some(Waiting { retained, round });
            self.shared.changed.notify_all();
        }
    }

    fn trouble(&mut self) -> Option<Trouble> {
        self.shared.lock().troubles.pop_front()
    }

    fn figures(&self) -> Figures {
        self.shared.lock().figures
    }
}

/// Writes until it is closed and nothing waits, or what waits cannot be written.
fn run(shared: &Shared, slots: &mut Slots) {
    let mut inner = shared.lock();
    loop {
        let Some(Waiting { retained, round }) = inner.waiting.take() else {
            if inner.closing {
                break;
            }
            inner = shared.changed.wait(inner).unwrap_or_else(PoisonError::into_inner);
            continue;
        };
        drop(inner);
        let written = slots.write(&retained);
        inner = shared.lock();
        match written {
            Ok(bytes) => {
                let figures = &mut inner.figures;
                figures.writes += 1;
                figures.size = bytes;
                figures.bytes = figures.bytes.saturating_add(bytes);
                figures.round_bytes = figures.round_bytes.saturating_add(if round { bytes } else { 0 });
                if inner.failing.take().is_some() {
                    inner.troubles.push_back(Trouble::Accepted);
                }
            }
            Err(error) => {
                // Newer states count more.
                inner.waiting.get_or_insert(Waiting { retained, round });
                if inner.failing.replace(error.to_string()).is_none() {
                    inner.troubles.push_back(Trouble::Refused(error.to_string()));
                }
                if inner.closing {
                    break;
                }
                inner = shared.changed.wait_timeout(inner, AGAIN).unwrap_or_else(PoisonError::into_inner).0;
            }
        }
    }
    inner.over = true;
    shared.changed.notify_all();
}
