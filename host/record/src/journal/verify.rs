//! Whether a journal is whole.

use super::tables::explains;
use super::{Filter, JournalError, Reader};
use latchwork_image::Value;
use std::path::Path;

/// Records read at once.
const PAGE: usize = 10_000;

/// Numbers without a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hole {
    /// The first that is missing.
    pub from: u64,
    /// The last that is missing.
    pub to: u64,
    /// A `lost` record says so.
    pub explained: bool,
}

/// What a verification has found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Verdict {
    /// Number of records.
    pub records: u64,
    /// First and last number.
    pub numbers: Option<(u64, u64)>,
    /// Numbers without a record.
    pub holes: Vec<Hole>,
    /// What the database says about damage; empty when it is whole.
    pub damage: Vec<String>,
}

impl Verdict {
    /// Nothing is damaged, and nothing is missing without an explanation.
    pub fn is_good(&self) -> bool {
        self.damage.is_empty() && self.holes.iter().all(|h| h.explained)
    }
}

/// Reads a whole journal; `progress` hears how many records have been read.
///
/// # Errors
/// No journal, or one that cannot be read at all.
pub fn verify(folder: &Path, mut progress: impl FnMut(u64)) -> Result<Verdict, JournalError> {
    let reader = Reader::open(folder)?;
    let mut verdict = Verdict { damage: integrity(&reader)?, ..Verdict::default() };
    let mut filter = Filter::default();
    let mut lost: Option<(u64, u64)> = None;
    loop {
        let page = match reader.records(filter, PAGE) {
            Ok(page) => page,
            Err(error) => {
                verdict.damage.push(format!("after record {}: {error}", filter.after));
                return Ok(verdict);
            }
        };
        let Some(last) = page.last().map(|r| r.seq) else { return Ok(verdict) };
        for record in &page {
            if let Some((_, before)) = verdict.numbers
                && record.seq != before + 1
            {
                let (from, to) = (before + 1, record.seq - 1);
                // The `lost` record stands in place of the first one that is missing.
                let told = lost.is_some_and(|(at, count)| at == before && count > to - before);

                verdict.holes.push(Hole { from, to, explained: told });
            }
            let count = if let Value::Integer(n) = record.current { u64::try_from(n).unwrap_or(0) } else { 0 };
            lost = explains(record).then_some((record.seq, count));
            verdict.records += 1;
            verdict.numbers = Some((verdict.numbers.map_or(record.seq, |n| n.0), record.seq));
        }
        filter.after = last;
        progress(verdict.records);
    }
}

fn integrity(reader: &Reader) -> Result<Vec<String>, JournalError> {
    let read = || -> rusqlite::Result<Vec<String>> {
        let mut check = reader.connection.prepare("PRAGMA integrity_check(20)")?;
        let rows = check.query_map([], |row| row.get::<_, String>(0))?;
        rows.collect()
    };
    let lines = read().map_err(|error| reader.failed(error))?;
    Ok(lines.into_iter().filter(|line| line != "ok").collect())
}
