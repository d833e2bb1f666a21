//! The journal: every record on disk before anybody else gets it.
//!
//! ```text
//! Router ──Record──► Journal::push (never waits) ──bounded queue──► thread ──a transaction per batch──► SQLite (WAL)
//!                                                                     └─► durable(): the highest number that is safe
//! ```
//!
//! A record is durable at most [`Options::within`] after it was pushed, plus what the disk takes. What cannot be written (a full
//! disk) waits in the queue; what finds that full is counted and becomes one `lost` record in place of the first one that is
//! missing. A damaged file is set aside and a new one begun. A number never stands for two records: where numbers cannot be
//! known any more, the next ones begin beyond all that were ever reserved.
//!
//! Besides records the file has state (of alarms, of retained commands) that is written with the record that changed it, and
//! a cursor per sink. What is too old or too much goes, oldest first, see [`Options::age`].

mod glance;
mod query;
mod reader;
mod retention;
mod store;
mod tables;
mod thread;
mod verify;
mod watch;

pub use glance::Glance;
pub use query::{KindSet, Query};
pub use reader::{Filter, Page, Reader};
pub use verify::{Hole, Verdict, verify};
pub use watch::Watch;

use crate::{Kept, Kind, Record};
use latchwork_image::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Name of the file in the data folder.
pub const FILE: &str = "journal.db";
/// Source of records that the journal makes itself.
pub const SOURCE: &str = "journal";
/// Transition of the record in place of some that found no room.
const OVERFLOW: &str = "overflow";

/// How a journal works.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// A record is written at most so long after it came. Before, it has waited for its turn in the order of time for up to
    /// 25 ms: with the default it is written within 100 ms.
    pub within: Duration,
    /// Records that may wait while the disk takes none.
    pub queue: usize,
    /// Records older than this go, counted back from the last one; `None`: none goes by its age. What a sink has not had
    /// stays.
    pub age: Option<Duration>,
    /// The file holds at most so many bytes, give or take a batch; `None`: as many as come. What a sink has not had goes too,
    /// and is told.
    pub size: Option<u64>,
    /// Names of the sinks there are: what they have not had is not too old.
    pub sinks: Vec<String>,
}

impl Default for Options {
    fn default() -> Self {
        Self { within: Duration::from_millis(70), queue: 200_000, age: None, size: None, sinks: Vec::new() }
    }
}

/// Why a journal cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The folder.
    #[error("the data folder {folder} cannot be used: {error}")]
    Folder {
        /// Folder.
        folder: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// The file is another plant's at this very moment.
    #[error("{path} is in use by another latchwork; give each plant a data folder of its own")]
    Taken {
        /// File.
        path: PathBuf,
    },
    /// There is no journal.
    #[error("there is no journal in {folder}; expected the folder that `latchwork run --data` was given")]
    Missing {
        /// Folder.
        folder: PathBuf,
    },
    /// The file is of a newer version.
    #[error("{path} has version {found} of the journal, this program knows {known}; use the newer latchwork")]
    Newer {
        /// File.
        path: PathBuf,
        /// Its version.
        found: i64,
        /// Ours.
        known: i64,
    },
    /// The database.
    #[error("{path}: {error}")]
    Database {
        /// File.
        path: PathBuf,
        /// Why.
        error: rusqlite::Error,
    },
}

impl JournalError {
    /// True when the file is damaged.
    pub fn is_damage(&self) -> bool {
        matches!(self, Self::Database { error, .. } if store::is_damage(error))
    }
}

/// What was found when a journal was opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Opening {
    /// Identity of the journal: numbers of another one say nothing about this. It stays when a damaged file is begun anew.
    pub journal: String,
    /// Number of the last record that may exist: the next one has the number after it.
    pub last: u64,
    /// A damaged file that was set aside.
    pub set_aside: Option<PathBuf>,
    /// What is kept besides records; of a damaged file, what could still be read.
    pub kept: BTreeMap<String, String>,
    /// How far each sink is: the number of the last record it has.
    pub cursors: BTreeMap<String, u64>,
}

/// What the journal's thread has to tell, besides what it writes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Notice {
    /// Nothing can be written: why.
    Refused(String),
    /// Writing works again.
    Accepted,
    /// The file was damaged, and stands there now.
    SetAside(PathBuf),
    /// The size is reached, or the file was damaged: records went that a sink has not had.
    Dropped {
        /// Name of the sink.
        sink: String,
        /// How many it will not get, at most: its filters may leave some out, and some may wait in its list.
        count: u64,
    },
}

/// Records that found no room.
struct Missing {
    first: Record,
    count: u64,
    /// State that would have come with them; the last value counts.
    kept: BTreeMap<String, Option<String>>,
}

impl Missing {
    fn keep(&mut self, kept: Vec<Kept>) {
        self.kept.extend(kept.into_iter().map(|k| (k.name, k.value)));
    }

    fn item(self) -> store::Item {
        let kept = self.kept.into_iter().map(|(name, value)| Kept { name, value }).collect();
        store::Item { record: Some(lost(&self.first, self.count)), kept }
    }
}

/// A journal that is being written.
pub struct Journal {
    sender: Option<Sender<store::Item>>,
    /// Items that wait, and how many may.
    waiting: Arc<AtomicUsize>,
    room: usize,
    thread: Option<JoinHandle<u64>>,
    watch: Watch,
    notices: Receiver<Notice>,
    missing: Option<Missing>,
    /// Number of the last record that was handed over.
    last: u64,
}

impl Journal {
    /// Opens the journal in a folder, or begins one.
    ///
    /// # Errors
    /// A folder that cannot be used, a journal in use or of a newer version. A damaged one is no error: it is set aside. Nor is
    /// a disk that is full or takes nothing, as long as what the file has can be read: records wait.
    pub fn open(folder: &Path, options: Options) -> Result<(Self, Opening), JournalError> {
        let (store, opening) = store::Store::open(folder, retention::Retention::new(&options))?;
        // Bounded by a count of its own: a queue that is empty nearly always shall not hold its memory.
        let (sender, receiver) = std::sync::mpsc::channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&waiting);
        let (tell, notices) = std::sync::mpsc::channel();
        let watch = Watch::new(opening.last, &opening.journal);
        let shared = watch.clone();
        let items = thread::Items { receiver, waiting: counted };
        let body = move || thread::run(store, &items, options.within, &shared, &tell);
        let thread = std::thread::Builder::new().name("journal".into()).spawn(body);
        let thread = thread.map_err(|error| JournalError::Folder { folder: folder.into(), error })?;
        let (sender, thread, room) = (Some(sender), Some(thread), options.queue.max(2));
        Ok((Self { sender, waiting, room, thread, watch, notices, missing: None, last: opening.last }, opening))
    }

    /// Hands a record over; never waits.
    pub fn push(&mut self, record: &Record) {
        self.push_with(record, Vec::new());
    }

    /// Hands a record over with the state that it stands for: both are on the disk, or neither; never waits.
    pub fn push_with(&mut self, record: &Record, kept: Vec<Kept>) {
        // Room for the record, and for the one about those that are missing.
        let full = self.waiting.load(Ordering::Relaxed) + 2 > self.room;
        match (&mut self.missing, full) {
            (Some(missing), true) => {
                missing.count += 1;
                missing.keep(kept);
            }
            (None, true) => {
                let mut missing = Missing { first: record.clone(), count: 1, kept: BTreeMap::new() };
                missing.keep(kept);
                self.missing = Some(missing);
            }
            (_, false) => {
                let before = self.missing.take().map(Missing::item);
                let item = store::Item { record: Some(record.clone()), kept };
                before.into_iter().chain([item]).for_each(|i| self.send(i));
            }
        }
    }

    /// Hands state over that no record stands for; never waits.
    pub fn keep(&mut self, kept: Vec<Kept>) {
        match &mut self.missing {
            // Not before the older state that waits for room.
            Some(missing) => missing.keep(kept),
            None if kept.is_empty() => {}
            None => self.send(store::Item { record: None, kept }),
        }
    }

    fn send(&mut self, item: store::Item) {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        self.last = item.record.as_ref().map_or(self.last, |r| r.seq);
        if let Some(sender) = &self.sender {
            // The thread outlives its queue unless it has panicked, and then nobody takes anything any more.
            let _ = sender.send(item);
        }
    }

    /// The highest number for which it and all before are safe on disk.
    pub fn durable(&self) -> u64 {
        self.watch.durable()
    }

    /// A handle for threads that follow the journal.
    pub fn watch(&self) -> Watch {
        self.watch.clone()
    }

    /// Waits until all that was handed over is durable; false if it is not when the time is up.
    pub fn settle(&mut self, timeout: Duration) -> bool {
        if let Some(missing) = self.missing.take() {
            self.send(missing.item());
        }
        let (end, never) = (Instant::now() + timeout, AtomicBool::new(false));
        while self.last > self.durable() {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() || self.thread.as_ref().is_none_or(JoinHandle::is_finished) {
                return false;
            }
            self.watch.wait(self.last - 1, left, &never);
        }
        true
    }

    /// What there is to tell, if anything.
    pub fn notice(&self) -> Option<Notice> {
        self.notices.try_recv().ok()
    }

    /// Writes what waits and closes the file. Waits as long as the disk takes, but gives up on one that takes nothing: the
    /// number of records that were left.
    pub fn close(mut self) -> u64 {
        self.end()
    }

    fn end(&mut self) -> u64 {
        let missing = self.missing.take();
        let Some(sender) = self.sender.take() else { return 0 };
        let left = missing.map_or(0, |missing| {
            let count = missing.count;
            if sender.send(missing.item()).is_ok() { 0 } else { count }
        });
        drop(sender);
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has written what it could.
            return left + thread.join().unwrap_or(0);
        }
        left
    }
}

impl Drop for Journal {
    fn drop(&mut self) {
        self.end();
    }
}

/// The record in place of the first of some that found no room.
fn lost(first: &Record, count: u64) -> Record {
    Record {
        seq: first.seq,
        time: first.time,
        kind: Kind::Lost,
        source: SOURCE.into(),
        transition: OVERFLOW.into(),
        previous: Value::None,
        current: Value::Integer(count.into()),
        priority: 200,
        user: String::new(),
        text: format!("{count} records found the journal's queue full and are gone"),
    }
}
