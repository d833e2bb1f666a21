//! How the sinks are, for whoever asks while they work.

use crate::component::Version;
use latchwork_record::journal::Watch;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What a sink does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// It takes records.
    #[default]
    Fine,
    /// It refuses them, and is offered them again now and then.
    Failing,
    /// It has panicked and gets nothing until the next run.
    Ended,
    /// The run is over.
    Stopped,
}

impl State {
    /// The word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fine => "fine",
            Self::Failing => "failing",
            Self::Ended => "ended",
            Self::Stopped => "stopped",
        }
    }
}

/// A sink at this moment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: String,
    /// The last record that it has, or that its filters leave out.
    pub cursor: u64,
    /// Numbers between that and the last record on the disk.
    pub behind: u64,
    /// What it does.
    pub state: State,
    /// Its component, of a sink that is one.
    pub version: Option<Version>,
    /// Why it refuses records, or why it has ended; empty otherwise.
    pub error: String,
}

/// The status of all sinks. Clones are the same handle.
#[derive(Clone, Default)]
pub struct Statuses {
    list: Arc<Mutex<Vec<Status>>>,
    watch: Watch,
}

impl Statuses {
    /// All of them, in the order of the plant file.
    pub fn list(&self) -> Vec<Status> {
        let durable = self.watch.durable();
        let mut list = self.lock().clone();
        // Counted here, because a sink that hangs counts nothing.
        list.iter_mut().for_each(|status| status.behind = durable.saturating_sub(status.cursor));
        list
    }

    pub(crate) fn new(watch: &Watch) -> Self {
        Self { watch: watch.clone(), ..Self::default() }
    }

    pub(crate) fn add(&self, status: Status) -> usize {
        let mut list = self.lock();
        list.push(status);
        list.len() - 1
    }

    pub(crate) fn change(&self, index: usize, change: impl FnOnce(&mut Status)) {
        if let Some(status) = self.lock().get_mut(index) {
            change(status);
        }
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Status>> {
        self.list.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
