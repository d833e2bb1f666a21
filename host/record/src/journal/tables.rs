//! The tables of the database: records, what is kept besides them, how far each sink is.

use super::{FILE, JournalError, OVERFLOW, SOURCE};
use crate::{Kind, Record};
use latchwork_image::Value;
use rusqlite::types::{ToSqlOutput, ValueRef};
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension, Row, Transaction, TransactionBehavior};
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

/// Opens the database for writing, and the version of its tables; 0 without any. Nothing is written where all are there.
pub(super) fn connect(folder: &Path) -> Result<(Connection, i64), JournalError> {
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
            "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA wal_autocheckpoint = 4000; \
             PRAGMA journal_size_limit = 67108864;",
        )
        .map_err(database)?;
    Ok((connection, version))
}

/// Makes the tables, or those that an older version lacks, in a transaction that is still open. A new file knows after which
/// number it began.
pub(super) fn create(connection: &mut Connection, after: Option<u64>) -> rusqlite::Result<Transaction<'_>> {
    let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
    transaction.execute_batch(&format!(
        "CREATE TABLE IF NOT EXISTS records (
             seq INTEGER PRIMARY KEY, time INTEGER NOT NULL, kind INTEGER NOT NULL, source TEXT NOT NULL,
             transition TEXT NOT NULL, previous, current, priority INTEGER NOT NULL, user TEXT NOT NULL,
             text TEXT NOT NULL);
         CREATE INDEX IF NOT EXISTS records_time ON records (time);
         CREATE TABLE IF NOT EXISTS kept (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
         CREATE TABLE IF NOT EXISTS sinks (
             name TEXT PRIMARY KEY, seq INTEGER NOT NULL, dropped INTEGER NOT NULL DEFAULT 0) WITHOUT ROWID;
         CREATE TABLE IF NOT EXISTS known (name TEXT PRIMARY KEY, value NOT NULL) WITHOUT ROWID;
         PRAGMA user_version = {VERSION};"
    ))?;
    if let Some(after) = after {
        transaction.execute("INSERT OR REPLACE INTO known (name, value) VALUES ('after', ?1)", [after as i64])?;
    }
    Ok(transaction)
}

/// Opens the database for reading where nothing can be written and nobody writes it: without its log.
pub(super) fn as_it_lies(folder: &Path) -> rusqlite::Result<Connection> {
    let name = path(folder).to_string_lossy().replace('%', "%25").replace('?', "%3f").replace('#', "%23");
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX | OpenFlags::SQLITE_OPEN_URI;
    let connection = Connection::open_with_flags(format!("file:{name}?immutable=1"), flags)?;
    let version = connection.query_row("PRAGMA user_version", [], |row| row.get::<_, i64>(0))?;
    // A newer one is refused by whoever opens it for writing.
    if version > VERSION { Err(rusqlite::Error::InvalidQuery) } else { Ok(connection) }
}

/// An identity that no other journal has.
pub(super) fn new_identity() -> rusqlite::Result<String> {
    Connection::open_in_memory()?.query_row("SELECT lower(hex(randomblob(16)))", [], |row| row.get(0))
}

/// Number and time of the last record.
pub(super) fn last(connection: &Connection) -> rusqlite::Result<Option<(u64, u64)>> {
    if !has(connection, "records")? {
        return Ok(None);
    }
    let row = connection.query_row("SELECT seq, time FROM records ORDER BY seq DESC LIMIT 1", [], |row| {
        Ok((row.get::<_, i64>(0)? as u64, row.get::<_, i64>(1)? as u64))
    });
    row.optional()
}

/// After which number the file began.
pub(super) fn began_after(connection: &Connection) -> rusqlite::Result<Option<u64>> {
    if !has(connection, "known")? {
        return Ok(None);
    }
    let row = connection.query_row("SELECT value FROM known WHERE name = 'after'", [], |row| row.get::<_, i64>(0));
    Ok(row.optional()?.map(|n| n as u64))
}

/// True when there is such a table.
pub(super) fn has(connection: &Connection, table: &str) -> rusqlite::Result<bool> {
    let there = "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = ?1";
    Ok(connection.query_row(there, [table], |row| row.get::<_, i64>(0))? > 0)
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
    if !has(connection, table)? {
        return Ok(BTreeMap::new());
    }
    let mut select = connection.prepare(select)?;
    select.query_map([], of)?.collect()
}

/// What could still be read of a damaged file: its last record, state, cursors.
type Salvaged = (Option<(u64, u64)>, BTreeMap<String, String>, BTreeMap<String, Cursor>);

/// What can still be read of a damaged file.
pub(super) fn salvage(path: &Path) -> Salvaged {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let Ok(connection) = Connection::open_with_flags(path, flags) else { return Default::default() };
    let (kept, cursors) = (kept(&connection).unwrap_or_default(), cursors(&connection).unwrap_or_default());
    (last(&connection).unwrap_or_default(), kept, cursors)
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

/// A record that explains why numbers are missing: those about a damaged file, or about what a sink will not get, do not.
pub(super) fn explains(record: &Record) -> bool {
    record.kind == Kind::Lost && record.source == SOURCE && record.transition == OVERFLOW
}
