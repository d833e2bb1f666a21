//! The file of a journal that is written: batches, damage, numbers that are taken.

use super::retention::Retention;
use super::tables::{self, Cursor, IDENTITY, Stored, begin, path};
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

/// The open database of a journal that is written.
pub(super) struct Store {
    folder: PathBuf,
    pub(super) connection: Connection,
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
        let lock = File::create(folder.join("journal.lock")).map_err(of_folder)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(std::fs::TryLockError::WouldBlock) => return Err(JournalError::Taken { path: path(folder) }),
            Err(std::fs::TryLockError::Error(error)) => return Err(of_folder(error)),
        }
        let reserved = read_reserved(folder).map_err(of_folder)?;
        let existed = path(folder).exists();
        let mut set_aside = None;
        let (connection, contents) = match begin(folder).and_then(|c| contents(folder, &c).map(|found| (c, found))) {
            Ok(begun) => begun,
            Err(JournalError::Database { error, .. }) if is_damage(&error) => {
                let aside = self::set_aside(folder).map_err(of_folder)?;
                let connection = begin(folder)?;
                let (kept, cursors) = tables::salvage(&aside);
                set_aside = Some(aside);
                (connection, Contents { last: (0, 0), kept, cursors })
            }
            Err(error) => return Err(error),
        };
        let Contents { last, kept, cursors } = contents;
        // A new file in place of a damaged or a removed one: no number of the old one may come twice.
        let anew = set_aside.is_some() || !existed;
        let last = if anew { (last.0.max(reserved.saturating_sub(1)), last.1) } else { last };
        let mut store =
            Self { folder: folder.into(), connection, reserved, last, kept, cursors, retention, _lock: lock };
        store.reserve(last.0 + 1).map_err(of_folder)?;
        let of_database = |error| JournalError::Database { path: path(folder), error };
        let named = store.kept.contains_key(IDENTITY);
        if !named {
            let new = || tables::new_identity(&store.connection).map_err(of_database);
            store.kept.insert(IDENTITY.into(), identity(folder, new)?);
        }
        if set_aside.is_some() || !named {
            store.write_copies().map_err(of_database)?;
        }
        let mut kept = store.kept.clone();
        let opening = Opening {
            journal: kept.remove(IDENTITY).unwrap_or_default(),
            last: last.0,
            set_aside,
            kept,
            cursors: store.cursors.iter().map(|(name, cursor)| (name.clone(), cursor.seq)).collect(),
        };
        Ok((store, opening))
    }

    /// Writes records with their state and the cursors that moved, as one, and to the disk.
    pub(super) fn write(&mut self, items: &[Item], moved: &BTreeMap<String, u64>) -> Result<(), WriteError> {
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
        let mut write = || -> rusqlite::Result<()> {
            let transaction = self.connection.transaction()?;
            insert(&transaction, items)?;
            keep(&transaction, &changes)?;
            move_cursors(
                &transaction,
                cursors.iter().filter(|(name, cursor)| self.cursors.get(*name) != Some(cursor)),
            )?;
            transaction.commit()
        };
        write().map_err(|error| WriteError::of(&error))?;
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

    /// Sets the damaged file aside and begins a new one, with the same state.
    pub(super) fn begin_anew(&mut self) -> Result<PathBuf, JournalError> {
        let of_folder = |error| JournalError::Folder { folder: self.folder.clone(), error };
        let aside = set_aside(&self.folder).map_err(of_folder)?;
        self.connection = begin(&self.folder)?;
        self.write_copies().map_err(|error| JournalError::Database { path: path(&self.folder), error })?;
        Ok(aside)
    }

    /// Writes all state and all cursors into the file.
    fn write_copies(&mut self) -> rusqlite::Result<()> {
        let transaction = self.connection.transaction()?;
        keep(&transaction, &self.kept.iter().map(|(name, value)| (name.as_str(), Some(value.as_str()))).collect())?;
        move_cursors(&transaction, self.cursors.iter())?;
        transaction.commit()
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
    last: (u64, u64),
    kept: BTreeMap<String, String>,
    cursors: BTreeMap<String, Cursor>,
}

fn contents(folder: &Path, connection: &Connection) -> Result<Contents, JournalError> {
    let read = || -> rusqlite::Result<Contents> {
        let (kept, cursors) = (tables::kept(connection)?, tables::cursors(connection)?);
        Ok(Contents { last: tables::last(connection)?, kept, cursors })
    };
    read().map_err(|error| JournalError::Database { path: path(folder), error })
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
            r.time as i64,
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
}

fn is_damage(error: &rusqlite::Error) -> bool {
    matches!(error.sqlite_error_code(), Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase))
}

fn read_reserved(folder: &Path) -> std::io::Result<u64> {
    match std::fs::read_to_string(folder.join(RESERVED)) {
        Ok(text) => Ok(text.trim().parse().unwrap_or(0)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(0),
        Err(error) => Err(error),
    }
}

/// The identity of the numbers in this folder, also where the database that knew it is damaged or gone; or a new one.
fn identity(folder: &Path, new: impl FnOnce() -> Result<String, JournalError>) -> Result<String, JournalError> {
    let of_folder = |error| JournalError::Folder { folder: folder.into(), error };
    let (path, draft) = (folder.join(IDENTITY), folder.join(format!("{IDENTITY}.new")));
    if let Some(known) = std::fs::read_to_string(&path).ok().filter(|text| !text.trim().is_empty()) {
        return Ok(known.trim().to_owned());
    }
    let identity = new()?;
    let write = || {
        std::fs::write(&draft, format!("{identity}\n"))?;
        File::open(&draft)?.sync_all()?;
        std::fs::rename(&draft, &path)?;
        File::open(folder)?.sync_all()
    };
    write().map_err(of_folder)?;
    Ok(identity)
}

/// Renames the database and what belongs to it; where it stands now.
fn set_aside(folder: &Path) -> std::io::Result<PathBuf> {
    let name = (1..).map(|n| folder.join(format!("journal.damaged-{n}.db"))).find(|p| !p.exists());
    let Some(aside) = name else { return Err(std::io::Error::other("no name is free")) };
    std::fs::rename(path(folder), &aside)?;
    for end in ["-wal", "-shm"] {
        let (from, to) = (folder.join(format!("{FILE}{end}")), PathBuf::from(format!("{}{end}", aside.display())));
        match std::fs::rename(from, to) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
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
        let aside = store.begin_anew().expect("a new file");
        assert!(aside.exists());
        store.write(&[item(3), item(4)], &BTreeMap::new()).expect("room");
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
            .execute_batch("DROP TABLE kept; DROP TABLE sinks; PRAGMA user_version = 1")
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
