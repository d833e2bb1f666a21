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

mod glance;
mod reader;
mod store;
mod thread;
mod verify;

pub use glance::Glance;
pub use reader::{Filter, Reader};
pub use verify::{Hole, Verdict, verify};

use crate::{Kind, Record};
use latchwork_image::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender};
use std::thread::JoinHandle;
use std::time::Duration;

/// Name of the file in the data folder.
pub const FILE: &str = "journal.db";
/// Source of records that the journal makes itself.
pub const SOURCE: &str = "journal";

/// How a journal works.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// A record is written at most so long after it came. Before, it has waited for its turn in the order of time for up to
    /// 25 ms: with the default it is written within 100 ms.
    pub within: Duration,
    /// Records that may wait while the disk takes none.
    pub queue: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { within: Duration::from_millis(70), queue: 200_000 }
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

/// What was found when a journal was opened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Opening {
    /// Number of the last record that may exist: the next one has the number after it.
    pub last: u64,
    /// A damaged file that was set aside.
    pub set_aside: Option<PathBuf>,
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
}

/// A journal that is being written.
pub struct Journal {
    sender: Option<Sender<Record>>,
    /// Records that wait, and how many may.
    waiting: Arc<AtomicUsize>,
    room: usize,
    thread: Option<JoinHandle<u64>>,
    durable: Arc<AtomicU64>,
    notices: Receiver<Notice>,
    /// First record that found no room, and how many did.
    missing: Option<(Record, u64)>,
}

impl Journal {
    /// Opens the journal in a folder, or begins one.
    ///
    /// # Errors
    /// A folder that cannot be written, a journal in use or of a newer version. A damaged one is no error: it is set aside.
    pub fn open(folder: &Path, options: Options) -> Result<(Self, Opening), JournalError> {
        let (store, opening) = store::Store::open(folder)?;
        // Bounded by a count of its own: a queue that is empty nearly always shall not hold its memory.
        let (sender, receiver) = std::sync::mpsc::channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        let counted = Arc::clone(&waiting);
        let (tell, notices) = std::sync::mpsc::channel();
        let durable = Arc::new(AtomicU64::new(opening.last));
        let shared = Arc::clone(&durable);
        let records = thread::Records { receiver, waiting: counted };
        let body = move || thread::run(store, &records, options.within, &shared, &tell);
        let thread = std::thread::Builder::new().name("journal".into()).spawn(body);
        let thread = thread.map_err(|error| JournalError::Folder { folder: folder.into(), error })?;
        let (sender, thread, room) = (Some(sender), Some(thread), options.queue.max(2));
        Ok((Self { sender, waiting, room, thread, durable, notices, missing: None }, opening))
    }

    /// Hands a record over; never waits.
    pub fn push(&mut self, record: &Record) {
        // Room for the record, and for the one about those that are missing.
        let full = self.waiting.load(Ordering::Relaxed) + 2 > self.room;
        match &mut self.missing {
            Some((_, count)) if full => *count += 1,
            None if full => self.missing = Some((record.clone(), 1)),
            missing => {
                let before = missing.take().map(|(first, count)| lost(&first, count));
                before.into_iter().chain([record.clone()]).for_each(|r| self.send(r));
            }
        }
    }

    fn send(&self, record: Record) {
        self.waiting.fetch_add(1, Ordering::Relaxed);
        if let Some(sender) = &self.sender {
            // The thread outlives its queue unless it has panicked, and then nobody takes anything any more.
            let _ = sender.send(record);
        }
    }

    /// The highest number for which it and all before are safe on disk.
    pub fn durable(&self) -> u64 {
        self.durable.load(Ordering::Acquire)
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
        let left = missing.map_or(0, |(first, count)| match sender.send(lost(&first, count)) {
            Ok(()) => 0,
            Err(_) => count,
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
        transition: "overflow".into(),
        previous: Value::None,
        current: Value::Integer(count.into()),
        priority: 200,
        user: String::new(),
        text: format!("{count} records found the journal's queue full and are gone"),
    }
}
