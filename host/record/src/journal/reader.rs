//! Reading, also while the journal is being written.

use super::store::{COLUMNS, read_only, record};
use super::{JournalError, store};
use crate::Record;
use rusqlite::{Connection, params};
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
        Ok(Self { connection: read_only(folder)?, path: store::path(folder) })
    }

    /// At most `limit` records, by number.
    ///
    /// # Errors
    /// A damaged or vanished file.
    pub fn records(&self, filter: Filter, limit: usize) -> Result<Vec<Record>, JournalError> {
        let number = |n: u64| i64::try_from(n).unwrap_or(i64::MAX);
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
