//! The tables of the database: records, what is kept besides them, how far each sink is.

use super::{FILE, JournalError, SOURCE};
use crate::{Kind, Record};
use latchwork_image::Value;
use rusqlite::types::{ToSqlOutput, ValueRef};
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, Row};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Version of the tables. 1 had records alone.
pub(super) const VERSION: i64 = 2;

/// The name that a journal's identity is kept under, and of a file beside with the same. It stays when a damaged file is begun
/// anew: numbers go on there.
pub(super) const IDENTITY: &str = "journal.identity";

/// How far a sink is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Cursor {
    /// The last record that it has.
    pub(super) seq: u64,
    /// Records that it did not have when they went, and of which no record tells yet.
    pub(super) dropped: u64,
}

/// Name of the database.
pub(super) fn path(folder: &Path) -> PathBuf {
    folder.join(FILE)
}

/// Opens the database for writing, with its tables; those of an older version are added to.
pub(super) fn begin(folder: &Path) -> Result<Connection, JournalError> {
    let path = path(folder);
    let database = |error| JournalError::Database { path: path.clone(), error };
    let connection = Connection::open(&path).map_err(database)?;
    let version: i64 = connection.query_row("PRAGMA user_version", [], |row| row.get(0)).map_err(database)?;
    if version > VERSION {
        return Err(JournalError::Newer { path, found: version, known: VERSION });
    }
    // FULL: a commit has reached the disk when it returns.
    connection
        .execute_batch(&format!(
            "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA wal_autocheckpoint = 4000; \
             PRAGMA journal_size_limit = 67108864;
             BEGIN IMMEDIATE;
             CREATE TABLE IF NOT EXISTS records (
                 seq INTEGER PRIMARY KEY, time INTEGER NOT NULL, kind INTEGER NOT NULL, source TEXT NOT NULL,
                 transition TEXT NOT NULL, previous, current, priority INTEGER NOT NULL, user TEXT NOT NULL,
                 text TEXT NOT NULL);
             CREATE INDEX IF NOT EXISTS records_time ON records (time);
             CREATE TABLE IF NOT EXISTS kept (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
             CREATE TABLE IF NOT EXISTS sinks (
                 name TEXT PRIMARY KEY, seq INTEGER NOT NULL, dropped INTEGER NOT NULL DEFAULT 0) WITHOUT ROWID;
             PRAGMA user_version = {VERSION};
             COMMIT;"
        ))
        .map_err(database)?;
    Ok(connection)
}

/// An identity that no other journal has.
pub(super) fn new_identity(connection: &Connection) -> rusqlite::Result<String> {
    connection.query_row("SELECT lower(hex(randomblob(16)))", [], |row| row.get(0))
}

/// Number and time of the last record; 0 without one.
pub(super) fn last(connection: &Connection) -> rusqlite::Result<(u64, u64)> {
    let row = connection.query_row("SELECT seq, time FROM records ORDER BY seq DESC LIMIT 1", [], |row| {
        Ok((row.get::<_, i64>(0)? as u64, row.get::<_, i64>(1)? as u64))
    });
    Ok(row.optional()?.unwrap_or_default())
}

/// What is kept besides records. A file of version 1 has nothing of it.
pub(super) fn kept(connection: &Connection) -> rusqlite::Result<BTreeMap<String, String>> {
    rows(connection, "kept", "SELECT name, value FROM kept", |row| Ok((row.get(0)?, row.get(1)?)))
}

/// How far the sinks are.
pub(super) fn cursors(connection: &Connection) -> rusqlite::Result<BTreeMap<String, Cursor>> {
    rows(connection, "sinks", "SELECT name, seq, dropped FROM sinks", |row| {
        let (seq, dropped) = (row.get::<_, i64>(1)? as u64, row.get::<_, i64>(2)? as u64);
        Ok((row.get(0)?, Cursor { seq, dropped }))
    })
}

fn rows<T>(
    connection: &Connection,
    table: &str,
    select: &str,
    of: impl Fn(&Row<'_>) -> rusqlite::Result<(String, T)>,
) -> rusqlite::Result<BTreeMap<String, T>> {
    let there = "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = ?1";
    if connection.query_row(there, [table], |row| row.get::<_, i64>(0))? == 0 {
        return Ok(BTreeMap::new());
    }
    let mut select = connection.prepare(select)?;
    select.query_map([], of)?.collect()
}

/// What can still be read of a damaged file.
pub(super) fn salvage(path: &Path) -> (BTreeMap<String, String>, BTreeMap<String, Cursor>) {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let Ok(connection) = Connection::open_with_flags(path, flags) else { return Default::default() };
    (kept(&connection).unwrap_or_default(), cursors(&connection).unwrap_or_default())
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
    let version = connection.query_row("PRAGMA user_version", [], |row| row.get::<_, i64>(0)).or_else(|error| {
        // Whoever began it was ended before it had its log; the next writer undoes what stands there.
        let half = path.with_file_name(format!("{FILE}-journal")).exists();
        if half && error.sqlite_error_code() == Some(ErrorCode::ReadOnly) { Ok(0) } else { Err(database(error)) }
    })?;
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
pub(super) struct Stored<'a>(pub(super) &'a Value);

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
pub(super) fn record(row: &Row<'_>) -> rusqlite::Result<Record> {
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
