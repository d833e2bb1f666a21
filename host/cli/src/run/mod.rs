//! What a user sees and keeps of a run: files, a live table or a line a second, a summary.

mod files;
mod journal;
mod lines;
mod picture;
mod retained;
mod screen;
pub(crate) mod summary;
mod table;

pub(crate) use files::Files;
pub(crate) use journal::Kept;
pub(crate) use lines::Lines;
pub(crate) use picture::Picture;
pub(crate) use retained::Retention;
pub(crate) use screen::Screen;
pub(crate) use table::{Table, cut};

use latchwork_plant::lane::Change;
use latchwork_plant::run::{Control, Observer};
use latchwork_record::{Kind, Record};
use std::collections::{BTreeMap, VecDeque};

/// Records a display remembers.
const RECENT: usize = 50;

/// What has happened so far, for displays and the summary.
#[derive(Default)]
pub(crate) struct History {
    /// The last records, oldest first.
    pub(crate) recent: VecDeque<Record>,
    /// Number of records by kind.
    pub(crate) by_kind: BTreeMap<Kind, u64>,
}

impl History {
    fn add(&mut self, record: &Record) {
        *self.by_kind.entry(record.kind).or_default() += 1;
        if self.recent.len() == RECENT {
            self.recent.pop_front();
        }
        self.recent.push_back(record.clone());
    }
}

/// A way to show a plant while it runs.
pub(crate) trait Show {
    /// Called often; draws only when it is time to. `now` is plant time, ns.
    fn tick(&mut self, now: u64, history: &History);
    /// The run is over.
    fn end(&mut self, now: u64, history: &History);
}

/// Shows nothing.
impl Show for () {
    fn tick(&mut self, _: u64, _: &History) {}
    fn end(&mut self, _: u64, _: &History) {}
}

/// What was written, and what went wrong in writing.
pub(crate) struct Written {
    /// Number of records by kind.
    pub(crate) by_kind: BTreeMap<Kind, u64>,
    /// Rows of the trace.
    pub(crate) rows: u64,
    /// Retained state, if there is any.
    pub(crate) retained: Option<retained::Written>,
    /// The first error of a file.
    pub(crate) error: Option<String>,
}

/// Watches a run for a user.
pub(crate) struct Watcher {
    files: Files,
    journal: Option<Kept>,
    show: Box<dyn Show>,
    history: History,
    now: u64,
}

impl Watcher {
    pub(crate) fn new(files: Files, journal: Option<Kept>, show: Box<dyn Show>) -> Self {
        Self { files, journal, show, history: History::default(), now: 0 }
    }

    /// Closes files and display.
    pub(crate) fn finish(mut self) -> Written {
        self.show.end(self.now, &self.history);
        let (rows, error) = self.files.finish();
        let of_journal = self.journal.and_then(Kept::finish);
        Written { by_kind: self.history.by_kind, rows, retained: None, error: of_journal.or(error) }
    }
}

impl Observer for Watcher {
    fn record(&mut self, record: &Record, kept: &[latchwork_record::Kept]) {
        if let Some(journal) = &mut self.journal {
            journal.record(record, kept);
        }
        self.files.record(record);
        self.history.add(record);
    }

    fn change(&mut self, change: &Change) {
        self.files.change(change);
    }

    fn tick(&mut self, now: u64) -> Control {
        self.now = now;
        if let Some(journal) = &mut self.journal {
            journal.tick(now);
        }
        self.files.tick(now);
        self.show.tick(now, &self.history);
        Control::Continue
    }
}
