//! Reading millions of records without a copy of any.

use super::{Filter, JournalError, Reader};
use crate::Kind;
use rusqlite::params;
use rusqlite::types::ValueRef;

/// What a report wants to know of a record, as it lies in the database.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glance<'a> {
    /// Time of the event, ns since 1970.
    pub time: u64,
    /// Kind.
    pub kind: Kind,
    /// What it is about.
    pub source: &'a str,
    /// What happened, in one word.
    pub transition: &'a str,
    /// The value after it, if that is a text.
    pub text: Option<&'a str>,
    /// The value after it, if that is a whole number.
    pub number: Option<i64>,
    /// 0 (a note) to 255.
    pub priority: u8,
}

impl Reader {
    /// Shows every record of a filter, by number: some three times as fast as [`Self::records`].
    ///
    /// # Errors
    /// A damaged or vanished file; what came before has been shown.
    pub fn glance(&self, filter: Filter, mut seen: impl FnMut(Glance<'_>)) -> Result<(), JournalError> {
        let number = |n: u64| i64::try_from(n).unwrap_or(i64::MAX);
        let mut read = || -> rusqlite::Result<()> {
            // The plus keeps SQLite from the index of times: all are read, and they shall come by number.
            let mut select = self.connection.prepare_cached(
                "SELECT time, kind, source, transition, current, priority FROM records \
                 WHERE seq > ?1 AND +time >= ?2 AND +time < ?3 ORDER BY seq",
            )?;
            let mut rows = select.query(params![number(filter.after), number(filter.from), number(filter.to)])?;
            while let Some(row) = rows.next()? {
                let kind: u8 = row.get(1)?;
                let current = row.get_ref(4)?;
                seen(Glance {
                    time: row.get::<_, i64>(0)? as u64,
                    kind: Kind::from_number(kind).ok_or(rusqlite::Error::IntegralValueOutOfRange(1, kind.into()))?,
                    source: row.get_ref(2)?.as_str()?,
                    transition: row.get_ref(3)?.as_str()?,
                    text: current.as_str().ok(),
                    number: if let ValueRef::Integer(n) = current { Some(n) } else { None },
                    priority: row.get(5)?,
                });
            }
            Ok(())
        };
        read().map_err(|error| self.failed(error))
    }
}
