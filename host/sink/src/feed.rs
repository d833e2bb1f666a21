//! What waits for one sink: a list of bounded length, filled from the journal in the order of numbers.

use crate::keys::Settings;
use latchwork_record::Record;
use latchwork_record::journal::{Query, Reader, Watch};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Numbers that one look at the journal goes through at most, so that filters which let little pass do not keep a sink from
/// its other duties.
const LOOK: u64 = 50_000;

/// The records that wait for a sink.
pub(crate) struct Feed {
    folder: PathBuf,
    settings: Settings,
    /// The open journal, and which of its files that is.
    reader: Option<(Reader, u64)>,
    list: Vec<Record>,
    /// Since when the first of the list waits.
    since: Instant,
    /// Everything up to here is kept, or left out by the filters.
    cursor: u64,
    /// Everything up to here is kept, left out, or in the list.
    read: u64,
}

impl Feed {
    pub(crate) fn new(folder: PathBuf, settings: Settings, cursor: u64) -> Self {
        Self { folder, settings, reader: None, list: Vec::new(), since: Instant::now(), cursor, read: cursor }
    }

    pub(crate) fn cursor(&self) -> u64 {
        self.cursor
    }

    /// The sink has everything up to a number, from an earlier run.
    pub(crate) fn skip_to(&mut self, seq: u64) {
        self.list.retain(|r| r.seq > seq);
        (self.cursor, self.read) = (self.cursor.max(seq), self.read.max(seq));
    }

    /// Reads what is durable and has room. True when there may be more at once.
    pub(crate) fn fill(&mut self, watch: &Watch) -> Result<bool, String> {
        let room = self.settings.list - self.list.len();
        let durable = watch.durable();
        if room == 0 || self.read >= durable {
            return Ok(false);
        }
        let page = self.look(watch, durable, room).inspect_err(|_| self.reader = None)?;
        if self.list.is_empty() {
            self.since = Instant::now();
        }
        self.read = page.reached;
        self.list.extend(page.records);
        if self.list.is_empty() {
            self.cursor = self.read;
        }
        Ok(self.list.len() < self.settings.list && self.read < durable)
    }

    fn look(&mut self, watch: &Watch, durable: u64, room: usize) -> Result<latchwork_record::journal::Page, String> {
        // After the number was asked for: what is durable by then is in this file, or in one that was set aside.
        let file = watch.files();
        if self.reader.as_ref().is_some_and(|(_, f)| *f != file) {
            self.reader = None;
        }
        let (reader, _) = match &mut self.reader {
            Some(open) => open,
            closed => closed.insert((Reader::open(&self.folder).map_err(|e| e.to_string())?, file)),
        };
        let fits = self.settings.sources.as_ref().map(|set| move |source: &str| set.is_match(source));
        let query = Query {
            after: self.read,
            until: durable.min(self.read + LOOK),
            kinds: self.settings.kinds,
            priority: self.settings.priority,
            source: fits.as_ref().map(|f| f as &dyn Fn(&str) -> bool),
            ..Query::default()
        };
        reader.page(&query, room).map_err(|error| {
            if error.is_damage() {
                watch.damaged(file, &error.to_string());
            }
            error.to_string()
        })
    }

    /// How long the list may wait for more; `None`: there is nothing in it.
    pub(crate) fn patience(&self) -> Option<Duration> {
        if self.list.is_empty() {
            None
        } else if self.list.len() >= self.settings.batch {
            Some(Duration::ZERO)
        } else {
            Some(self.settings.wait.saturating_sub(self.since.elapsed()))
        }
    }

    /// The records to send.
    pub(crate) fn batch(&self) -> &[Record] {
        &self.list[..self.list.len().min(self.settings.most)]
    }

    /// Records in the list, and numbers after it.
    pub(crate) fn waiting(&self, watch: &Watch) -> u64 {
        self.list.len() as u64 + watch.durable().saturating_sub(self.read)
    }

    /// The sink says that it has everything up to a number of the batch it was offered.
    pub(crate) fn kept(&mut self, seq: u64) -> Result<(), String> {
        let batch = self.batch();
        let (Some(first), Some(last)) = (batch.first().map(|r| r.seq), batch.last().map(|r| r.seq)) else {
            return Ok(());
        };
        if seq > last {
            return Err(format!("it claims to have kept record {seq}, but was offered none after {last}"));
        }
        if seq < first {
            return Err(format!("it kept none of the {} records it was offered", batch.len()));
        }
        self.list.retain(|r| r.seq > seq);
        self.cursor = if self.list.is_empty() { self.read } else { seq };
        Ok(())
    }
}
