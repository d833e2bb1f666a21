//! The file of a journal that is written: batches, damage, numbers that are taken.

use super::retention::Retention;
use super::tables::{self, Cursor, IDENTITY, Stored, path};
use super::{FILE, JournalError, Opening};
use crate::{Kept, Record};
use rusqlite::{Connection, ErrorCode, Transaction, params};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Name of the file with the reserved numbers.
const RESERVED: &str = "journal.reserved";
/// Numbers reserved ahead: so many may be passed over when a journal was damaged.
const RESERVE: u64 = 100_000;

/// What goes into the file together: a record and the state that belongs to it.
#[derive(Debug)]
pub(super) struct Item {
    pub(super) record: Option<Record>,
    pub(super) kept: Vec<Kept>,
}

/// The journal that is written. Its file may not be open: the disk is full, or takes nothing.
pub(super) struct Store {
    folder: PathBuf,
    pub(super) connection: Option<Connection>,
    /// What the file has is known here too.
    known: bool,
    /// A damaged file that was set aside, and in whose place none has begun yet.
    aside: Option<PathBuf>,
    /// The next number beyond what was reserved.
    reserved: u64,
    /// Number and time of the last record.
    pub(super) last: (u64, u64),
    /// What the file has besides records, for the next one if this is damaged.
    kept: BTreeMap<String, String>,
    pub(super) cursors: BTreeMap<String, Cursor>,
    pub(super) retention: Retention,
    /// Held while the journal is open, so that no other program writes it.
    _lock: File,
}

impl Store {
    pub(super) fn open(folder: &Path, retention: Retention) -> Result<(Self, Opening), JournalError> {
        let of_folder = |error| JournalError::Folder { folder: folder.into(), error };
        std::fs::create_dir_all(folder).map_err(of_folder)?;
        let lock = folder.join("journal.lock");
        // Where nothing can be written, one of an earlier run will do.
        let lock = File::create(&lock).or_else(|error| File::open(&lock).map_err(|_| error)).map_err(of_folder)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => return Err(JournalError::Taken { path: path(folder) }),
            Err(std::fs::TryLockError::Error(error)) => return Err(of_folder(error)),
        }
        let reserved = read_reserved(folder).map_err(of_folder)?;
        let mut store = Self {
            folder: folder.into(),
            connection: None,
            known: false,
            aside: None,
            reserved,
            // Of a file that is removed, or damaged beyond reading: no number of it may come twice.
            last: (reserved.saturating_sub(1), 0),
            kept: BTreeMap::new(),
            cursors: BTreeMap::new(),
            retention,
            _lock: lock,
        };
        match store.begin() {
            Err(JournalError::Database { error, .. }) if is_damage(&error) => {
                store.set_aside().map_err(of_folder)?;
                match store.begin() {
                    Err(error) if !may_pass(&error) => return Err(error),
                    _ => {}
                }
            }
            // The plant runs all the same; the thread goes on trying.
            Err(error) if may_pass(&error) && (store.known || store.peek()) => {}
            begun => begun?,
        }
        if !store.kept.contains_key(IDENTITY) {
            store.kept.insert(IDENTITY.into(), identity(folder));
        }
        let mut kept = store.kept.clone();
        let opening = Opening {
            journal: kept.remove(IDENTITY).unwrap_or_default(),
            last: store.last.0,
            set_aside: store.aside.take(),
            kept,
            cursors: store.cursors.iter().map(|(name, cursor)| (name.clone(), cursor.seq)).collect(),
        };
        Ok((store, opening))
    }

    /// Opens the file. One that is new, or that nobody has come to give its tables, gets them with all state.
    fn begin(&mut self) -> Result<(), JournalError> {
        let there = path(&self.folder).exists();
        let (mut connection, version) = tables::connect(&self.folder)?;
        let file = path(&self.folder);
        let database = |error| JournalError::Database { path: file.clone(), error };
        if !self.known {
            if version == 0 {
                self.salvage(there);
            } else {
                let found = Contents::read(&connection).map_err(database)?;
                self.take(found);
            }
        }
        if version < tables::VERSION {
            let anew = (version == 0).then(|| self.last.0.max(self.reserved.saturating_sub(1)));
            let mut create = || -> rusqlite::Result<()> {
                let transaction = tables::create(&mut connection, anew)?;
                if anew.is_some() {
                    let kept = self.kept.iter().map(|(name, value)| (name.as_str(), Some(value.as_str())));
                    keep(&transaction, &kept.collect())?;
                    move_cursors(&transaction, self.cursors.iter())?;
                }
                transaction.commit()
            };
            create().map_err(database)?;
        }
        self.connection = Some(connection);
        Ok(())
    }

    /// Looks into a file that cannot be opened for writing, and that nobody writes; false if it does not tell all it has.
    fn peek(&mut self) -> bool {
        let size = |end: &str| std::fs::metadata(self.folder.join(format!("{FILE}{end}"))).map_or(0, |m| m.len());
        if size("-wal") > 0 || size("-journal") > 0 {
            return false;
        }
        if size("") == 0 {
            self.salvage(path(&self.folder).exists());
            return true;
        }
        let read = |c: Connection| Ok(if tables::has(&c, "records")? { Some(Contents::read(&c)?) } else { None });
        match tables::as_it_lies(&self.folder).and_then(read) {
            Ok(Some(found)) => self.take(found),
            Ok(None) => self.salvage(true),
            Err(_) => return false,
        }
        true
    }

    fn take(&mut self, found: Contents) {
        (self.kept, self.cursors, self.known) = (found.kept, found.cursors, true);
        // Without a record, and of a time before the first number stood in it: as if it were new.
        self.last = found.last.unwrap_or(self.last);
    }

    /// What a file without tables was to have: it has begun in place of the one that was set aside last, and a full disk or an
    /// end came between.
    fn salvage(&mut self, there: bool) {
        self.known = true;
        if let Some(aside) = asides(&self.folder).take_while(|p| p.exists()).last().filter(|_| there) {
            self.salvage_from(&aside);
        }
    }

    fn salvage_from(&mut self, aside: &Path) {
        let found;
        (found, self.kept, self.cursors) = tables::salvage(aside);
        self.miss(found.map_or(self.last.0, |(seq, _)| seq));
    }

    /// Sinks do not get any more what the file had up to a number: it is to be told.
    fn miss(&mut self, to: u64) {
        for (name, cursor) in &mut self.cursors {
            if cursor.seq < to && self.retention.is_for(name) {
                cursor.dropped += to - cursor.seq;
                *self.retention.dropped.entry(name.clone()).or_default() += to - cursor.seq;
                cursor.seq = to;
            }
        }
    }

    /// Writes records with their state and the cursors that moved, as one, and to the disk.
    pub(super) fn write(&mut self, items: &[Item], moved: &BTreeMap<String, u64>) -> Result<(), WriteError> {
        if self.connection.is_none() {
            self.begin().map_err(|error| WriteError::of_opening(&error))?;
        }
        let last = items.iter().rev().find_map(|i| i.record.as_ref());
        if let Some(last) = last {
            self.reserve(last.seq + 1).map_err(|e| WriteError::Refused(e.to_string()))?;
        }
        let told = self.retention.told_by(items.iter().filter_map(|i| i.record.as_ref()));
        // The last value of a name counts.
        let changes: BTreeMap<&str, Option<&str>> =
            items.iter().flat_map(|i| &i.kept).map(|k| (k.name.as_str(), k.value.as_deref())).collect();
        let mut cursors = self.cursors.clone();
        for (name, seq) in moved {
            cursors.entry(name.clone()).or_default().seq = *seq;
        }
        for (name, count) in &told {
            let cursor = cursors.entry(name.clone()).or_default();
            cursor.dropped = cursor.dropped.saturating_sub(*count);
        }
        let Some(connection) = &mut self.connection else { return Ok(()) };
        let mut write = || -> rusqlite::Result<()> {
            let transaction = connection.transaction()?;
            insert(&transaction, items)?;
            keep(&transaction, &changes)?;
            move_cursors(
                &transaction,
                cursors.iter().filter(|(name, cursor)| self.cursors.get(*name) != Some(cursor)),
            )?;
            transaction.commit()
        };
        if let Err(error) = write() {
            // It stays so for as long as the file is open.
            if error.sqlite_error_code() == Some(ErrorCode::ReadOnly) {
                self.connection = None;
            }
            return Err(WriteError::of(&error));
        }
        for (name, value) in changes {
            match value {
                Some(value) => self.kept.insert(name.into(), value.into()),
                None => self.kept.remove(name),
            };
        }
        self.cursors = cursors;
        self.retention.told(told.len());
        if let Some(last) = last {
            self.last = (last.seq, self.last.1.max(last.time));
        }
        Ok(())
    }

    /// Sets the damaged file aside; the next write begins a new one, with the same state.
    pub(super) fn set_aside(&mut self) -> std::io::Result<()> {
        // It would remove the log of the new one.
        self.connection = None;
        // One that is empty was begun just now.
        if std::fs::metadata(path(&self.folder)).is_ok_and(|m| m.len() > 0) {
            let aside = set_aside(&self.folder)?;
            if self.known {
                self.miss(self.last.0);
            } else {
                self.known = true;
                self.salvage_from(&aside);
            }
            self.aside = Some(aside);
        }
        Ok(())
    }

    /// True while no file is open: what waits may be nothing but the state.
    pub(super) fn is_to_begin(&self) -> bool {
        self.connection.is_none()
    }

    /// The file that was set aside, once a new one has begun; told once.
    pub(super) fn begun_anew(&mut self) -> Option<PathBuf> {
        if self.connection.is_some() { self.aside.take() } else { None }
    }

    /// Makes sure that numbers below `next` and some more are known to be taken, whatever becomes of the database.
    fn reserve(&mut self, next: u64) -> std::io::Result<()> {
        if next < self.reserved {
            return Ok(());
        }
        let reserved = next + RESERVE;
        let new = self.folder.join("journal.reserved.new");
        std::fs::write(&new, format!("{reserved}\n"))?;
        File::open(&new)?.sync_all()?;
        std::fs::rename(&new, self.folder.join(RESERVED))?;
        File::open(&self.folder)?.sync_all()?;
        self.reserved = reserved;
        Ok(())
    }
}

/// What a file has.
struct Contents {
    /// Number and time of the last record, or the number it began after.
    last: Option<(u64, u64)>,
    kept: BTreeMap<String, String>,
    cursors: BTreeMap<String, Cursor>,
}

impl Contents {
    fn read(connection: &Connection) -> rusqlite::Result<Self> {
        let last = tables::last(connection)?;
        let last = if last.is_some() { last } else { tables::began_after(connection)?.map(|seq| (seq, 0)) };
        Ok(Self { last, kept: tables::kept(connection)?, cursors: tables::cursors(connection)? })
    }
}

fn insert(transaction: &Transaction<'_>, items: &[Item]) -> rusqlite::Result<()> {
    // What was written and is offered again, because nobody knows whether it was, is the same record.
    let mut insert = transaction.prepare_cached(
        "INSERT OR IGNORE INTO records (seq, time, kind, source, transition, previous, current, priority, user, text) \
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
    )?;
    for r in items.iter().filter_map(|i| i.record.as_ref()) {
        insert.execute(params![
            r.seq as i64,
            // What lies beyond is beyond every filter; the year 2262.
            i64::try_from(r.time).unwrap_or(i64::MAX - 1),
            r.kind as u8,
            r.source,
            r.transition,
            Stored(&r.previous),
            Stored(&r.current),
            r.priority,
            r.user,
            r.text
        ])?;
    }
    Ok(())
}

fn keep(transaction: &Transaction<'_>, changes: &BTreeMap<&str, Option<&str>>) -> rusqlite::Result<()> {
    if changes.is_empty() {
        return Ok(());
    }
    let mut keep = transaction.prepare_cached("INSERT OR REPLACE INTO kept (name, value) VALUES (?1, ?2)")?;
    let mut remove = transaction.prepare_cached("DELETE FROM kept WHERE name = ?1")?;
    for (name, value) in changes {
        match value {
            Some(value) => keep.execute(params![name, value])?,
            None => remove.execute(params![name])?,
        };
    }
    Ok(())
}

pub(super) fn move_cursors<'a>(
    transaction: &Transaction<'_>,
    cursors: impl Iterator<Item = (&'a String, &'a Cursor)>,
) -> rusqlite::Result<()> {
    let mut insert =
        transaction.prepare_cached("INSERT OR REPLACE INTO sinks (name, seq, dropped) VALUES (?1, ?2, ?3)")?;
    for (name, cursor) in cursors {
        insert.execute(params![name, cursor.seq as i64, cursor.dropped as i64])?;
    }
    Ok(())
}

/// Why a batch was not written.
#[derive(Debug)]
pub(super) enum WriteError {
    /// It may be taken later: a full disk, no permission.
    Refused(String),
    /// The file is damaged.
    Damaged(String),
}

impl WriteError {
    pub(super) fn of(error: &rusqlite::Error) -> Self {
        if is_damage(error) { Self::Damaged(error.to_string()) } else { Self::Refused(error.to_string()) }
    }

    fn of_opening(error: &JournalError) -> Self {
        if let JournalError::Database { error, .. } = error {
            Self::of(error)
        } else {
            Self::Refused(error.to_string())
        }
    }
}

/// True for what may end by itself: a disk that is full, or takes nothing for now.
fn may_pass(error: &JournalError) -> bool {
    use ErrorCode::{CannotOpen, DiskFull, ReadOnly, SystemIoFailure};
    let JournalError::Database { error, .. } = error else { return false };
    matches!(error.sqlite_error_code(), Some(DiskFull | ReadOnly | CannotOpen | SystemIoFailure))
}

pub(super) fn is_damage(error: &rusqlite::Error) -> bool {
    matches!(error.sqlite_error_code(), Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase))
}

fn read_reserved(folder: &Path) -> std::io::Result<u64> {
    match std::fs::read_to_string(folder.join(RESERVED)) {
        Ok(text) => Ok(text.trim().parse().unwrap_or(0)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(0),
        Err(error) => Err(error),
    }
}

/// Names for damaged files, in the order they are used.
fn asides(folder: &Path) -> impl Iterator<Item = PathBuf> {
    (1..).map(move |n| folder.join(format!("journal.damaged-{n}.db")))
}

/// The identity of the numbers in this folder, also where the database that knew it is damaged or gone; or a new one.
fn identity(folder: &Path) -> String {
    let (path, draft) = (folder.join(IDENTITY), folder.join(format!("{IDENTITY}.new")));
    if let Some(known) = std::fs::read_to_string(&path).ok().filter(|text| !text.trim().is_empty()) {
        return known.trim().to_owned();
    }
    // Without one, numbers are believed to be those of the last journal.
    let identity = tables::new_identity().unwrap_or_default();
    let write = || {
        std::fs::write(&draft, format!("{identity}\n"))?;
        File::open(&draft)?.sync_all()?;
        std::fs::rename(&draft, &path)?;
        File::open(folder)?.sync_all()
    };
    // On a full disk it stands in the database alone, once that can be written.
    let _ = write();
    identity
}

/// Renames the database and what belongs to it; where it stands now.
fn set_aside(folder: &Path) -> std::io::Result<PathBuf> {
    let Some(aside) = asides(folder).find(|p| !p.exists()) else {
        return Err(std::io::Error::other("no name is free"));
    };
    // The database last: a new one never finds the log of the old one.
    for end in ["-wal", "-shm"] {
        let (from, to) = (folder.join(format!("{FILE}{end}")), PathBuf::from(format!("{}{end}", aside.display())));
        match std::fs::rename(from, to) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    std::fs::rename(path(folder), &aside)?;
    // A file without tables says that state stands in the one that was set aside. It will be made anyhow.
    let _ = File::create(path(folder));
    Ok(aside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Kind;
    use crate::journal::{Filter, Reader};
    use latchwork_image::Value;

    fn item(seq: u64) -> Item {
        let kept = vec![Kept { name: format!("n{}", seq % 2), value: (seq != 4).then(|| seq.to_string()) }];
        Item { record: Some(record(seq)), kept }
    }

    fn record(seq: u64) -> Record {
        Record {
            seq,
            time: seq,
            kind: Kind::Event,
            source: "x".into(),
            transition: "changed".into(),
            previous: Value::None,
            current: Value::None,
            priority: 0,
            user: String::new(),
            text: String::new(),
        }
    }

    fn numbers(folder: &Path) -> Vec<u64> {
        let reader = Reader::open(folder).expect("a journal");
        reader.records(Filter::default(), 100).expect("records").iter().map(|r| r.seq).collect()
    }

    #[test]
    fn a_file_begun_anew_while_the_plant_runs_keeps_what_is_written_then_and_all_state() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let (mut store, _) = Store::open(folder.path(), Retention::default()).expect("a journal");
        store.write(&[item(1), item(2)], &[("file".to_owned(), 2)].into()).expect("room");
        store.set_aside().expect("a new name");
        assert_eq!(store.begun_anew(), None, "not yet");
        store.write(&[item(3), item(4)], &BTreeMap::new()).expect("room");
        assert!(store.begun_anew().expect("a new file").exists());
        // Another program sees it at once, and it is there after the end.
        assert_eq!(numbers(folder.path()), [3, 4]);
        assert!(folder.path().join("journal.db-wal").exists(), "the new file has its log");
        let reader = Reader::open(folder.path()).expect("a journal");
        assert_eq!(reader.kept().expect("state"), [("n1".to_owned(), "3".to_owned())].into());
        assert_eq!(reader.cursors().expect("cursors"), [("file".to_owned(), 2)].into());
        drop(store);
        assert_eq!(numbers(folder.path()), [3, 4]);
    }

    #[test]
    fn a_file_of_version_1_is_taken_over() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let (mut store, _) = Store::open(folder.path(), Retention::default()).expect("a journal");
        store.write(&[item(1)], &BTreeMap::new()).expect("room");
        store
            .connection
            .as_ref()
            .expect("an open file")
            .execute_batch("DROP TABLE known; DROP TABLE kept; DROP TABLE sinks; PRAGMA user_version = 1")
            .expect("as it was");
        drop(store);
        let reader = Reader::open(folder.path()).expect("an old journal");
        assert!(reader.kept().expect("none").is_empty() && reader.cursors().expect("none").is_empty());
        let (mut store, opening) = Store::open(folder.path(), Retention::default()).expect("a journal");
        let journal = reader.journal().expect("an identity");
        assert_eq!(journal.len(), 32);
        assert_eq!(opening, Opening { last: 1, journal, ..Opening::default() });
        store.write(&[item(2)], &[("file".to_owned(), 1)].into()).expect("room");
        assert_eq!(numbers(folder.path()), [1, 2]);
        assert_eq!(reader.cursors().expect("cursors"), [("file".to_owned(), 1)].into());
    }
}
