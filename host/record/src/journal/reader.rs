//! Reading, also while the journal is being written.

use super::JournalError;
use super::query::Query;
use super::tables::{self, COLUMNS, read_only, record};
use crate::Record;
use rusqlite::{Connection, Row, ToSql, params};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Which records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filter {
    /// Numbers above this one.
    pub after: u64,
    /// Not older than this, ns since 1970.
    pub from: u64,
    /// Older than this, ns since 1970.
    pub to: u64,
}

impl Default for Filter {
    fn default() -> Self {
        Self { after: 0, from: 0, to: u64::MAX }
    }
}

/// Records of one look, and how far it went.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// Records that were asked for, by number.
    pub records: Vec<Record>,
    /// Everything up to this number has been looked at: the next page begins after it.
    pub reached: u64,
}

/// A journal that is read.
pub struct Reader {
    pub(super) connection: Connection,
    path: PathBuf,
}

impl Reader {
    /// Opens the journal in a folder.
    ///
    /// # Errors
    /// No journal there, one of a newer version, one that cannot be read.
    pub fn open(folder: &Path) -> Result<Self, JournalError> {
        Ok(Self { connection: read_only(folder)?, path: tables::path(folder) })
    }

    /// At most `limit` records, by number.
    ///
    /// # Errors
    /// A damaged or vanished file.
    pub fn records(&self, filter: Filter, limit: usize) -> Result<Vec<Record>, JournalError> {
        let read = || -> rusqlite::Result<Vec<Record>> {
            let mut select = self.connection.prepare_cached(&format!(
                "SELECT {COLUMNS} FROM records WHERE seq > ?1 AND time >= ?2 AND time < ?3 ORDER BY seq LIMIT ?4"
            ))?;
            let rows = select.query_map(
                params![number(filter.after), number(filter.from), number(filter.to), number(limit as u64)],
                record,
            )?;
            rows.collect()
        };
        read().map_err(|error| self.failed(error))
    }

    /// At most `limit` records by number, and how far the search went. A bound `query.until` also bounds what one call costs:
    /// a query that little fits reads everything up to there.
    ///
    /// # Errors
    /// A damaged or vanished file.
    pub fn page(&self, query: &Query<'_>, limit: usize) -> Result<Page, JournalError> {
        let records = self.select(query, "ASC", limit).map_err(|error| self.failed(error))?;
        let reached = match records.last() {
            Some(last) if records.len() >= limit => last.seq,
            _ => query.until,
        };
        Ok(Page { records, reached })
    }

    /// The last `limit` records, by number.
    ///
    /// # Errors
    /// A damaged or vanished file.
    pub fn newest(&self, query: &Query<'_>, limit: usize) -> Result<Vec<Record>, JournalError> {
        let mut records = self.select(query, "DESC", limit).map_err(|error| self.failed(error))?;
        records.reverse();
        Ok(records)
    }

    fn select(&self, query: &Query<'_>, order: &str, limit: usize) -> rusqlite::Result<Vec<Record>> {
        let mut select = self.connection.prepare_cached(&format!(
            "SELECT {COLUMNS} FROM records WHERE seq > ?1 AND seq <= ?2 AND time >= ?3 AND time < ?4 \
             AND (?5 >> kind) & 1 = 1 AND priority >= ?6 ORDER BY seq {order}"
        ))?;
        let (after, until, from, to) = (number(query.after), number(query.until), number(query.from), number(query.to));
        let values: [&dyn ToSql; 6] = [&after, &until, &from, &to, &query.kinds.bits(), &query.priority];
        let mut rows = select.query(&values[..])?;
        let mut records = Vec::new();
        while records.len() < limit
            && let Some(row) = rows.next()?
        {
            if wanted(row, query)? {
                records.push(record(row)?);
            }
        }
        Ok(records)
    }

    /// What is kept besides records, by name.
    ///
    /// # Errors
    /// A damaged or vanished file.
    pub fn kept(&self) -> Result<BTreeMap<String, String>, JournalError> {
        let mut kept = tables::kept(&self.connection).map_err(|error| self.failed(error))?;
        kept.remove(tables::IDENTITY);
        Ok(kept)
    }

    /// Identity of the journal; empty in a file that was not opened for writing since there are any.
    ///
    /// # Errors
    /// A damaged or vanished file.
    pub fn journal(&self) -> Result<String, JournalError> {
        let kept = tables::kept(&self.connection).map_err(|error| self.failed(error))?;
        // A file of an older version knows none: it stands beside.
        let beside = || std::fs::read_to_string(self.path.with_file_name(tables::IDENTITY)).unwrap_or_default();
        Ok(kept.get(tables::IDENTITY).cloned().unwrap_or_else(|| beside().trim().to_owned()))
    }

    /// How far each sink is: the number of the last record it has.
    ///
    /// # Errors
    /// A damaged or vanished file.
    pub fn cursors(&self) -> Result<BTreeMap<String, u64>, JournalError> {
        let cursors = tables::cursors(&self.connection).map_err(|error| self.failed(error))?;
        Ok(cursors.into_iter().map(|(name, cursor)| (name, cursor.seq)).collect())
    }

    /// Number of the newest record; 0 if there is none.
    ///
    /// # Errors
    /// A damaged or vanished file.
    pub fn last(&self) -> Result<u64, JournalError> {
        let read =
            self.connection.query_row("SELECT coalesce(max(seq), 0) FROM records", [], |row| row.get::<_, i64>(0));
        read.map(|n| u64::try_from(n).unwrap_or(0)).map_err(|error| self.failed(error))
    }

    pub(super) fn failed(&self, error: rusqlite::Error) -> JournalError {
        JournalError::Database { path: self.path.clone(), error }
    }
}

fn wanted(row: &Row<'_>, query: &Query<'_>) -> rusqlite::Result<bool> {
    let Some(source) = query.source else { return Ok(true) };
    Ok(row.get_ref(3)?.as_str().is_ok_and(source))
}

/// As SQLite counts.
fn number(n: u64) -> i64 {
    i64::try_from(n).unwrap_or(i64::MAX)
}
