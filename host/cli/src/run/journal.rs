//! `--data`: the journal that keeps the records of a run.

use anyhow::Result;
use latchwork_plant::assemble::Plant;
use latchwork_record::journal::{Journal, Notice, Options};
use latchwork_record::{Entry, Kind, Record, Recorder, SourceId};
use std::path::Path;

/// Priority of a record about the journal itself.
const PRIORITY: u8 = 200;

/// The journal of a run.
pub(crate) struct Kept {
    journal: Journal,
    /// What the journal has to tell goes the way of all records.
    own: Option<(Recorder, SourceId)>,
}

impl Kept {
    /// Opens the journal in a folder; the plant's records go on after those that are in it.
    pub(crate) fn open(folder: &Path, plant: &mut Plant) -> Result<Self> {
        let (journal, opening) = Journal::open(folder, Options::default())?;
        plant.router.continue_after(opening.last);
        let mut kept = Self { journal, own: plant.journal.take() };
        if let Some(aside) = opening.set_aside {
            kept.tell(0, &Notice::SetAside(aside));
        }
        Ok(kept)
    }

    pub(crate) fn record(&mut self, record: &Record, _kept: &[latchwork_record::Kept]) {
        self.journal.push(record);
    }

    /// Now and then: what the journal has to tell.
    pub(crate) fn tick(&mut self, now: u64) {
        while let Some(notice) = self.journal.notice() {
            self.tell(now, &notice);
        }
    }

    fn tell(&mut self, now: u64, notice: &Notice) {
        let Some((recorder, source)) = &mut self.own else { return };
        let entry = |kind, transition| Entry::new(now, kind, *source, transition).priority(PRIORITY);
        let entry = match notice {
            Notice::Refused(why) => entry(Kind::Io, "refused").text(format_args!(
                "the journal cannot be written: {why}; records wait in memory, as many as there is room for"
            )),
            Notice::Accepted => entry(Kind::Io, "accepted").text(format_args!("the journal is written again")),
            Notice::SetAside(path) => entry(Kind::Lost, "damaged").text(format_args!(
                "the journal was damaged and stands in {} now; a new one has begun",
                path.display()
            )),
        };
        recorder.push(entry);
    }

    /// Closes the journal; a sentence if something could not be written.
    pub(crate) fn finish(self) -> Option<String> {
        let durable = self.journal.durable();
        match self.journal.close() {
            0 => None,
            left => Some(format!("the journal is incomplete: {left} records after number {durable} were not written")),
        }
    }
}
