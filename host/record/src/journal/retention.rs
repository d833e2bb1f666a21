//! What goes: the oldest records, beyond an age or a size, in steps that are short.
//!
//! A record that a configured sink has not had stays beyond its age. Beyond the size it goes, and is told: what was not told
//! yet stands in the file, so that a kill in between does not hide it.

use super::store::{Store, WriteError, move_cursors};
use super::{Options, SOURCE};
use crate::{Kind, Record};
use rusqlite::{Connection, params};
use std::collections::{BTreeMap, VecDeque};
use std::time::{SystemTime, UNIX_EPOCH};

/// Transition of the record that tells what a sink will not get.
pub(super) const TRANSITION: &str = "retention";
/// Records that go in one transaction at most.
const STEP: usize = 10_000;
/// Once it is too large, a file becomes this much smaller than allowed, percent: so it is told now and then, not always.
const SLACK: u64 = 10;

/// What may stay, and what has to be told.
#[derive(Default)]
pub(super) struct Retention {
    /// ns
    age: Option<u64>,
    /// Bytes.
    size: Option<u64>,
    sinks: Vec<String>,
    shrinking: bool,
    /// Dropped in the steps so far or with a damaged file, by sink; told when the last step is done.
    pub(super) dropped: BTreeMap<String, u64>,
    /// What was told, and has not come back as a record yet.
    awaited: VecDeque<(String, u64)>,
}

/// What a look has come to.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Step {
    /// There is more to do.
    pub(super) more: bool,
    /// What sinks will not get, if all is done.
    pub(super) tell: Vec<(String, u64)>,
}

impl Retention {
    pub(super) fn new(options: &Options) -> Self {
        let age = options.age.map(|age| u64::try_from(age.as_nanos()).unwrap_or(u64::MAX));
        Self { age, size: options.size, sinks: options.sinks.clone(), ..Self::default() }
    }

    /// What of that which was told is among the records.
    pub(super) fn told_by<'a>(&self, records: impl Iterator<Item = &'a Record>) -> Vec<(String, u64)> {
        if self.awaited.is_empty() {
            return Vec::new();
        }
        let tells = |r: &&Record| r.kind == Kind::Lost && r.source == SOURCE && r.transition == TRANSITION;
        self.awaited.iter().take(records.filter(tells).count()).cloned().collect()
    }

    /// True for a sink of the plant.
    pub(super) fn is_for(&self, name: &str) -> bool {
        self.sinks.iter().any(|n| n == name)
    }

    /// So many of it need not be told again.
    pub(super) fn told(&mut self, count: usize) {
        self.awaited.drain(..count.min(self.awaited.len()));
    }
}

impl Store {
    /// At the opening: all that was dropped and no record tells of, by an earlier run or with a damaged file.
    pub(super) fn untold(&mut self) -> Vec<(String, u64)> {
        self.retention.dropped.clear();
        let list: Vec<_> =
            self.cursors.iter().filter(|(_, c)| c.dropped > 0).map(|(name, c)| (name.clone(), c.dropped)).collect();
        self.retention.awaited.extend(list.iter().cloned());
        list
    }

    /// Takes one step, if there is something to do.
    pub(super) fn retain(&mut self) -> Result<Step, WriteError> {
        if self.connection.is_none() {
            return Ok(Step::default());
        }
        let unlimited = (self.retention.age, self.retention.size) == (None, None);
        let more = !unlimited && self.step().map_err(|error| WriteError::of(&error))?;
        if more {
            return Ok(Step { more, tell: Vec::new() });
        }
        let tell: Vec<_> = std::mem::take(&mut self.retention.dropped).into_iter().collect();
        self.retention.awaited.extend(tell.iter().cloned());
        Ok(Step { more: false, tell })
    }

    /// Drops some of what is to go; false when that was all.
    fn step(&mut self) -> rusqlite::Result<bool> {
        let Some(connection) = &mut self.connection else { return Ok(false) };
        let used = used(connection)?;
        let size = self.retention.size.unwrap_or(u64::MAX);
        let aim = size - size / 100 * SLACK;
        self.retention.shrinking = used > if self.retention.shrinking { aim } else { size };
        // One record of a wrong clock makes none old that is not.
        let cutoff = self.retention.age.map_or(0, |age| self.last.1.min(now()).saturating_sub(age));
        let seq = |name: &String| self.cursors.get(name).map_or(0, |c| c.seq);
        let had_by_all = self.retention.sinks.iter().map(seq).min().unwrap_or(u64::MAX);
        let mut oldest: Vec<u64> = Vec::new();
        {
            let mut select = connection.prepare_cached("SELECT seq, time FROM records ORDER BY seq LIMIT ?1")?;
            let mut rows = select.query(params![STEP as i64])?;
            while let Some(row) = rows.next()? {
                let (seq, time) = (row.get::<_, i64>(0)? as u64, row.get::<_, i64>(1)? as u64);
                // As many as make up what is too much, by the mean size of a record.
                let all = self.last.0 - oldest.first().unwrap_or(&seq).min(&self.last.0) + 1;
                let too_much = self.retention.shrinking
                    && u128::from(used) * oldest.len() as u128
                        <= u128::from(used.saturating_sub(aim)) * u128::from(all);
                // The last record stays: the next run's numbers go on after it.
                if seq >= self.last.0 || !(too_much || time < cutoff && seq <= had_by_all) {
                    break;
                }
                oldest.push(seq);
            }
        }
        let Some(end) = oldest.last().copied() else { return Ok(false) };
        let mut cursors = self.cursors.clone();
        let mut dropped = self.retention.dropped.clone();
        for name in &self.retention.sinks {
            let cursor = cursors.entry(name.clone()).or_default();
            let count = oldest.iter().filter(|seq| **seq > cursor.seq).count() as u64;
            if count > 0 {
                cursor.dropped += count;
                *dropped.entry(name.clone()).or_default() += count;
            }
        }
        let transaction = connection.transaction()?;
        transaction.prepare_cached("DELETE FROM records WHERE seq <= ?1")?.execute(params![end as i64])?;
        move_cursors(&transaction, cursors.iter().filter(|(name, c)| self.cursors.get(*name) != Some(c)))?;
        transaction.commit()?;
        (self.cursors, self.retention.dropped) = (cursors, dropped);
        Ok(oldest.len() == STEP || self.retention.shrinking)
    }
}

/// Bytes of the file that hold something.
fn used(connection: &Connection) -> rusqlite::Result<u64> {
    let pragma = |name: &str| connection.query_row(&format!("PRAGMA {name}"), [], |row| row.get::<_, i64>(0));
    let pages = pragma("page_count")? - pragma("freelist_count")?;
    Ok((pages * pragma("page_size")?) as u64)
}

/// The system's clock, ns since 1970.
fn now() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
