//! Where a plant hands its states to.

use crate::Retained;
use std::sync::{Arc, Mutex, PoisonError};

const DAY: u64 = 24 * 3600 * 1_000_000_000;

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Figures {
    /// Rounds of saving, also those in which nothing had changed.
    pub rounds: u64,
    /// Writings.
    pub writes: u64,
    /// Bytes of all writings, whole blocks of the file system.
    pub bytes: u64,
    /// Bytes of those that a round has caused; the others come of stops and swaps.
    pub round_bytes: u64,
    /// Size of the last writing, bytes.
    pub size: u64,
}

impl Figures {
    /// Bytes a day that come of rounds every so many nanoseconds, if they go on as they have so far; `None` before the
    /// first.
    pub fn bytes_a_day(&self, every: u64) -> Option<u64> {
        let a_day = u128::from(self.round_bytes) * u128::from(DAY) / u128::from(every.max(1));
        let mean = a_day.checked_div(self.rounds.into())?;
        Some(u64::try_from(mean).unwrap_or(u64::MAX))
    }
}

/// What a vault has to tell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// It cannot write, and why. It tries again; told once until it can.
    Refused(String),
    /// It can again.
    Accepted,
}

/// Keeps states. Called by the plant's thread: it must not wait for a disk.
pub trait Vault: Send {
    /// These are the states now; `None`: nothing has changed. A `round` is one of those that come by the clock.
    fn keep(&mut self, retained: Option<Retained>, round: bool);
    /// What it has to tell.
    fn trouble(&mut self) -> Option<Trouble>;
    /// What was written so far.
    fn figures(&self) -> Figures;
}

/// Keeps everything it was given in memory: for tests, and plants at virtual time that leave nothing behind.
#[derive(Clone, Default)]
pub struct Memory {
    kept: Arc<Mutex<(Vec<Retained>, Figures)>>,
}

impl Memory {
    /// All that was kept, oldest first.
    pub fn all(&self) -> Vec<Retained> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).0.clone()
    }
}

impl Vault for Memory {
    fn keep(&mut self, retained: Option<Retained>, round: bool) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let (all, figures) = &mut *kept;
        figures.rounds += u64::from(round);
        let Some(retained) = retained else { return };
        // The size it would have on a disk; what does not fit there has none.
        figures.size = crate::encode(figures.writes, &retained).map_or(0, |bytes| bytes.len() as u64);
        figures.writes += 1;
        figures.bytes += figures.size;
        figures.round_bytes += if round { figures.size } else { 0 };
        all.push(retained);
    }

    fn trouble(&mut self) -> Option<Trouble> {
        None
    }

    fn figures(&self) -> Figures {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).1
    }
}
