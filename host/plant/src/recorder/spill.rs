//! The files: segments one after another, a new file at every sixteenth of the room, the oldest deleted.
//!
//! A thread of its own writes, because a disk may take its time; what it cannot keep up with is left out and said.

use latchwork_testbed::replay::{ENDING, header};
use std::fs::{File, OpenOptions};
use std::io::{Error, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// Segments that may wait for the disk.
const WAITING: usize = 1024;
/// Files at most.
const FILES: u64 = 16;

enum Order {
    Segment(Vec<u8>),
    Component(String, Vec<u8>),
    Sync,
}

/// The way to the disk.
pub(super) struct Spill {
    orders: Option<SyncSender<Order>>,
    thread: Option<JoinHandle<()>>,
    failure: Arc<Mutex<Option<String>>>,
    run: u64,
}

impl Spill {
    /// Into a folder, which is made; at most `room` bytes of segments.
    pub(super) fn open(folder: &Path, room: u64) -> std::io::Result<Self> {
        std::fs::create_dir_all(folder)?;
        let files = segments(folder)?;
        let run = files.iter().filter_map(|f| f.run).max().unwrap_or(0) + 1;
        let (orders, incoming) = sync_channel(WAITING);
        let failure = Arc::new(Mutex::new(None));
        let writer = Writer { folder: folder.into(), room, run, number: 0, file: None, failure: Arc::clone(&failure) };
        let thread = std::thread::Builder::new().name("recorder".into()).spawn(move || writer.work(&incoming))?;
        Ok(Self { orders: Some(orders), thread: Some(thread), failure, run })
    }

    /// Number of this run among those in the folder.
    pub(super) fn run(&self) -> u64 {
        self.run
    }

    /// A segment. In real time nobody waits for the disk.
    pub(super) fn segment(&mut self, chunk: Vec<u8>, real_time: bool) {
        self.order(Order::Segment(chunk), real_time);
    }

    pub(super) fn component(&mut self, hash: String, bytes: &[u8]) {
        self.order(Order::Component(hash, bytes.to_vec()), false);
    }

    /// What was ordered is to be on the disk as soon as it can.
    pub(super) fn sync(&mut self) {
        self.order(Order::Sync, true);
    }

    fn order(&mut self, order: Order, no_waiting: bool) {
        let Some(orders) = &self.orders else { return };
        if !no_waiting {
            // The thread ends only after this end has gone.
            let _ = orders.send(order);
        } else if let Err(TrySendError::Full(_)) = orders.try_send(order) {
            fail(&self.failure, "the disk is too slow; segments are left out".into());
        }
    }

    /// What has gone wrong since it was asked last.
    pub(super) fn failure(&mut self) -> Option<String> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Drop for Spill {
    /// Waits for the disk: the plant has stopped.
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // A panic has been told by itself.
            let _ = thread.join();
        }
    }
}

fn fail(failure: &Mutex<Option<String>>, why: String) {
    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(why);
}

struct Writer {
    folder: PathBuf,
    room: u64,
    run: u64,
    number: u64,
    file: Option<(File, u64)>,
    failure: Arc<Mutex<Option<String>>>,
}

impl Writer {
    fn work(mut self, incoming: &Receiver<Order>) {
        // One sentence about a disk that is full, not one per segment.
        let mut well = true;
        for order in incoming {
            let done = match order {
                Order::Segment(chunk) => self.segment(&chunk),
                Order::Component(hash, bytes) => self.component(&hash, &bytes),
                Order::Sync => self.sync(),
            };
            if let Err(error) = &done {
                // A new file begins whole; the end of this one may be torn.
                self.file = None;
                if well {
                    fail(&self.failure, format!("{}: {error}", self.folder.display()));
                }
            }
            well = done.is_ok();
        }
        let _ = self.sync();
    }

    fn segment(&mut self, chunk: &[u8]) -> Result<(), Error> {
        let part = self.room / FILES;
        if self.file.as_ref().is_some_and(|(_, length)| *length > 0 && length + chunk.len() as u64 > part) {
            self.sync()?;
            self.file = None;
        }
        let file = match &mut self.file {
            Some(file) => file,
            none => {
                let (mut file, beginning) = (next_file(&self.folder, self.run, &mut self.number)?, header());
                make_room(&self.folder, self.room.saturating_sub(part.max(chunk.len() as u64)))?;
                file.write_all(&beginning)?;
                none.insert((file, beginning.len() as u64))
            }
        };
        file.0.write_all(chunk)?;
        file.1 += chunk.len() as u64;
        Ok(())
    }

    /// Whole or not at all.
    fn component(&self, hash: &str, bytes: &[u8]) -> Result<(), Error> {
        let path = self.folder.join(format!("{hash}.wasm"));
        if path.exists() {
            return Ok(());
        }
        let new = path.with_extension("new");
        let mut file = File::create(&new)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        std::fs::rename(new, path)
    }

    fn sync(&self) -> Result<(), Error> {
        self.file.as_ref().map_or(Ok(()), |(file, _)| file.sync_data())
    }
}

/// A file of segments.
struct Listed {
    path: PathBuf,
    run: Option<u64>,
    length: u64,
}

/// Files of segments, the oldest first.
fn segments(folder: &Path) -> std::io::Result<Vec<Listed>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let path = entry.path();
        if path.extension().is_some_and(|e| e == ENDING) {
            let run = path.file_stem().and_then(|s| s.to_str()?.split('-').next()?.parse().ok());
            files.push(Listed { run, length: entry.metadata()?.len(), path });
        }
    }
    files.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(files)
}

/// Run and number in six digits each: their names are in the order of time.
fn next_file(folder: &Path, run: u64, number: &mut u64) -> Result<File, Error> {
    *number += 1;
    OpenOptions::new().write(true).create_new(true).open(folder.join(format!("{run:06}-{number:06}.{ENDING}")))
}

/// Deletes the oldest files until the rest is no longer than this. The newest stays.
fn make_room(folder: &Path, length: u64) -> Result<(), Error> {
    let files = segments(folder)?;
    let mut sum: u64 = files.iter().map(|f| f.length).sum();
    for file in files.iter().take(files.len().saturating_sub(1)) {
        if sum <= length {
            break;
        }
        std::fs::remove_file(&file.path)?;
        sum -= file.length;
    }
    Ok(())
}
