//! The database: one table of records, one of what is known of it.

use super::{FILE, JournalError, Opening, SOURCE};
use crate::{Kind, Record};
use latchwork_image::Value;
use rusqlite::types::{ToSqlOutput, ValueRef};
use rusqlite::{Connection, ErrorCode, OpenFlags, params};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Version of the tables.
const VERSION: i64 = 1;
/// Name of the file with the reserved numbers.
const RESERVED: &str = "journal.reserved";
/// Numbers reserved ahead: so many may be passed over when a journal was damaged.
const RESERVE: u64 = 100_000;

/// The open database of a journal that is written.
pub(super) struct Store {
    folder: PathBuf,
    connection: Connection,
    /// The next number beyond what was reserved.
    reserved: u64,
    /// Held while the journal is open, so that no other program writes it.
    _lock: File,
}

pub(super) fn path(folder: &Path) -> PathBuf {
    folder.join(FILE)
}

impl Store {
    pub(super) fn open(folder: &Path) -> Result<(Self, Opening), JournalError> {
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
        let (connection, last) = match begin(folder) {
            Ok(begun) => begun,
            Err(JournalError::Database { error, .. }) if is_damage(&error) => {
                set_aside = Some(self::set_aside(folder).map_err(of_folder)?);
                begin(folder)?
            }
            Err(error) => return Err(error),
        };
        // A new file in place of a damaged or a removed one: no number of the old one may come twice.
        let anew = set_aside.is_some() || !existed;
        let last = if anew { last.max(reserved.saturating_sub(1)) } else { last };
        let mut store = Self { folder: folder.into(), connection, reserved, _lock: lock };
        store.reserve(last + 1).map_err(of_folder)?;
        Ok((store, Opening { last, set_aside }))
    }

    /// Writes records as one, and to the disk.
    pub(super) fn write(&mut self, records: &[Record]) -> Result<(), WriteError> {
        if let Some(last) = records.last() {
            self.reserve(last.seq + 1).map_err(|e| WriteError::Refused(e.to_string()))?;
        }
        self.insert(records).map_err(|error| {
            if is_damage(&error) {
                WriteError::Damaged(error.to_string())
            } else {
                WriteError::Refused(error.to_string())
            }
        })
    }

    fn insert(&mut self, records: &[Record]) -> rusqlite::Result<()> {
        let transaction = self.connection.transaction()?;
        {
            // What was written and is offered again, because nobody knows whether it was, is the same record.
            let mut insert = transaction.prepare_cached(
                "INSERT OR IGNORE INTO records (seq, time, kind, source, transition, previous, current, priority, user, text) \
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
            )?;
            for r in records {
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
        }
        transaction.commit()
    }

    /// Sets the damaged file aside and begins a new one.
    pub(super) fn begin_anew(&mut self) -> Result<PathBuf, JournalError> {
        let of_folder = |error| JournalError::Folder { folder: self.folder.clone(), error };
        let aside = set_aside(&self.folder).map_err(of_folder)?;
        (self.connection, _) = begin(&self.folder)?;
        Ok(aside)
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

/// Why a batch was not written.
#[derive(Debug)]
pub(super) enum WriteError {
    /// It may be taken later: a full disk, no permission.
    Refused(String),
    /// The file is damaged.
    Damaged(String),
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

/// Opens the database for writing, with its tables; the last number in it.
fn begin(folder: &Path) -> Result<(Connection, u64), JournalError> {
    let path = path(folder);
    let database = |error| JournalError::Database { path: path.clone(), error };
    let connection = Connection::open(&path).map_err(database)?;
    let version: i64 = connection.query_row("PRAGMA user_version", [], |row| row.get(0)).map_err(database)?;
    if version > VERSION {
        return Err(JournalError::Newer { path, found: version, known: VERSION });
    }
    // FULL: a commit has reached the disk when it returns.
    connection
        .execute_batch(
            &format!(
                "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA wal_autocheckpoint = 4000; \
             PRAGMA journal_size_limit = 67108864;
             BEGIN IMMEDIATE;
             CREATE TABLE IF NOT EXISTS records (
                 seq INTEGER PRIMARY KEY, time INTEGER NOT NULL, kind INTEGER NOT NULL, source TEXT NOT NULL,
                 transition TEXT NOT NULL, previous, current, priority INTEGER NOT NULL, user TEXT NOT NULL,
                 text TEXT NOT NULL);
             CREATE INDEX IF NOT EXISTS records_time ON records (time);
             PRAGMA user_version = {VERSION};
             COMMIT;"
            )
            .replace("", ""),
        )
        .map_err(database)?;
    let last: Option<i64> =
        connection.query_row("SELECT max(seq) FROM records", [], |row| row.get(0)).map_err(database)?;
    Ok((connection, last.unwrap_or(0) as u64))
}

/// Opens the database for reading alone.
pub(super) fn read_only(folder: &Path) -> Result<Connection, JournalError> {
    let path = path(folder);
    if !path.exists() {
        return Err(JournalError::Missing { folder: folder.into() });
    }
    let database = |error| JournalError::Database { path: path.clone(), error };
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(&path, flags).map_err(database)?;
    connection.busy_timeout(Duration::from_secs(5)).map_err(database)?;
    let version: i64 = connection.query_row("PRAGMA user_version", [], |row| row.get(0)).map_err(database)?;
    if version > VERSION {
        return Err(JournalError::Newer { path, found: version, known: VERSION });
    }
    // Whoever began it was ended before it had its tables.
    if version == 0 {
        return Err(JournalError::Missing { folder: folder.into() });
    }
    Ok(connection)
}

/// A value as SQLite keeps it: booleans and NaN, which it does not have, as blobs of one and of eight bytes.
struct Stored<'a>(&'a Value);

impl rusqlite::ToSql for Stored<'_> {
    fn to_sql(&self) -> rusqlite::Result<ToSqlOutput<'_>> {
        use rusqlite::types::Value as Sql;
        Ok(match self.0 {
            Value::None => ToSqlOutput::Owned(Sql::Null),
            Value::Boolean(b) => ToSqlOutput::Owned(Sql::Blob(vec![u8::from(*b)])),
            Value::Integer(i) => match i64::try_from(*i) {
                Ok(i) => ToSqlOutput::Owned(Sql::Integer(i)),
                Err(_) => ToSqlOutput::Owned(Sql::Blob(i.to_le_bytes().to_vec())),
            },
            Value::Real(r) if r.is_nan() => ToSqlOutput::Owned(Sql::Blob(r.to_le_bytes().to_vec())),
            Value::Real(r) => ToSqlOutput::Owned(Sql::Real(*r)),
            Value::Text(t) => ToSqlOutput::Borrowed(ValueRef::Text(t.as_bytes())),
        })
    }
}

/// The value that [`Stored`] has kept.
fn restored(value: ValueRef<'_>) -> Value {
    match value {
        ValueRef::Null => Value::None,
        ValueRef::Integer(i) => Value::Integer(i.into()),
        ValueRef::Real(r) => Value::Real(r),
        ValueRef::Text(t) => Value::Text(String::from_utf8_lossy(t).into_owned()),
        ValueRef::Blob(blob) => match (blob, <[u8; 16]>::try_from(blob), <[u8; 8]>::try_from(blob)) {
            ([byte], ..) => Value::Boolean(*byte != 0),
            (_, Ok(bytes), _) => Value::Integer(i128::from_le_bytes(bytes)),
            (_, _, Ok(bytes)) => Value::Real(f64::from_le_bytes(bytes)),
            _ => Value::None,
        },
    }
}

/// The columns that [`record`] takes.
pub(super) const COLUMNS: &str = "seq, time, kind, source, transition, previous, current, priority, user, text";

/// A record from a row of [`COLUMNS`].
pub(super) fn record(row: &rusqlite::Row<'_>) -> rusqlite::Result<Record> {
    let kind: u8 = row.get(2)?;
    Ok(Record {
        seq: row.get::<_, i64>(0)? as u64,
        time: row.get::<_, i64>(1)? as u64,
        kind: Kind::from_number(kind).ok_or(rusqlite::Error::IntegralValueOutOfRange(2, kind.into()))?,
        source: row.get(3)?,
        transition: row.get::<_, String>(4)?.into(),
        previous: restored(row.get_ref(5)?),
        current: restored(row.get_ref(6)?),
        priority: row.get(7)?,
        user: row.get(8)?,
        text: row.get(9)?,
    })
}

/// A record that explains why numbers are missing.
pub(super) fn explains(record: &Record) -> bool {
    record.kind == Kind::Lost && record.source == SOURCE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::journal::{Filter, Reader};

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
    fn a_file_begun_anew_while_the_plant_runs_keeps_what_is_written_then() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let (mut store, _) = Store::open(folder.path()).expect("a journal");
        store.write(&[record(1), record(2)]).expect("room");
        let aside = store.begin_anew().expect("a new file");
        assert!(aside.exists());
        store.write(&[record(3)]).expect("room");
        // Another program sees it at once, and it is there after the end.
        assert_eq!(numbers(folder.path()), [3]);
        assert!(folder.path().join("journal.db-wal").exists(), "the new file has its log");
        drop(store);
        assert_eq!(numbers(folder.path()), [3]);
    }
}
