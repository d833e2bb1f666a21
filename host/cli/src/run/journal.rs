//! `--data`: the journal that keeps the records of a run, and the sinks that read it.

use anyhow::{Context, Result};
use latchwork_plant::assemble::Plant;
use latchwork_record::journal::{Journal, Notice};
use latchwork_record::{Datum, Entry, Kind, Record, Recorder, SourceId};
use latchwork_sink::{Report, Runner, What};
use std::path::Path;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// Priority of a record about the journal itself, or about a sink.
const PRIORITY: u8 = 200;
/// Longest wait for the last records to be durable before the sinks end.
const SETTLE: Duration = Duration::from_secs(2);

/// The journal of a run.
pub(crate) struct Kept {
    journal: Journal,
    /// What the journal and the sinks have to tell goes the way of all records.
    own: Option<(Recorder, SourceId)>,
    sinks: Sinks,
}

struct Sinks {
    runner: Runner,
    /// Sources of records about each.
    sources: Vec<SourceId>,
    reports: Receiver<Report>,
}

impl Kept {
    /// Opens the journal in a folder; the plant's records go on after those that are in it, and its sinks begin to work.
    pub(crate) fn open(folder: &Path, plant: &mut Plant) -> Result<Self> {
        let (journal, opening) = Journal::open(folder, plant.model.journal.clone())?;
        plant.router.continue_after(opening.last);
        plant.restore(&opening.kept);
        let (tell, reports) = channel();
        let sinks = plant.model.sinks.iter().map(|s| (s.kind, s.config.clone()));
        // The receiver lives as long as the threads are listened to.
        let tell = move |report| drop(tell.send(report));
        let runner = Runner::start(folder, sinks, &opening.cursors, &journal.watch(), tell);
        let runner = runner.context("the system gives no threads for the sinks")?;
        plant.serve_sinks(runner.swapper());
        let (statuses, watch) = (runner.statuses(), journal.watch());
        plant.desk.also("journal", move || serde_json::json!({ "durable": watch.durable() }));
        plant.desk.also("sinks", move || statuses.list().iter().map(status).collect());
        let sinks = Sinks { runner, sources: std::mem::take(&mut plant.sinks), reports };
        let mut kept = Self { journal, own: plant.journal.take(), sinks };
        if let Some(aside) = opening.set_aside {
            kept.tell(0, &Notice::SetAside(aside));
        }
        Ok(kept)
    }

    pub(crate) fn record(&mut self, record: &Record, kept: &[latchwork_record::Kept]) {
        self.journal.push_with(record, kept.to_vec());
    }

    /// Now and then: what the journal and the sinks have to tell.
    pub(crate) fn tick(&mut self, now: u64) {
        while let Some(notice) = self.journal.notice() {
            self.tell(now, &notice);
        }
        while let Ok(report) = self.sinks.reports.try_recv() {
            self.tell_of_sink(now, &report);
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
            Notice::Dropped { sink, count } => entry(Kind::Lost, "retention")
                .change(Datum::None, Datum::Integer(i64::try_from(*count).unwrap_or(i64::MAX)))
                .text(format_args!(
                    "up to {count} records went that sink `{sink}` has not had: the journal has reached its size, or was damaged"
                )),
        };
        recorder.push(entry);
    }

    fn tell_of_sink(&mut self, now: u64, report: &Report) {
        let (Some((recorder, _)), Some(source)) = (&mut self.own, self.sinks.sources.get(report.sink)) else { return };
        let entry = |kind, transition| Entry::new(now, kind, *source, transition).priority(PRIORITY);
        recorder.push(match &report.what {
            What::Refused(why) => entry(Kind::Io, "refused").text(format_args!("{why}")),
            What::Accepted { waiting } => entry(Kind::Io, "accepted")
                .change(Datum::None, Datum::Integer(i64::try_from(*waiting).unwrap_or(i64::MAX)))
                .text(format_args!("it takes records again; {waiting} wait for it")),
            What::Ended(why) => entry(Kind::Fault, "ended")
                .text(format_args!("it has failed by itself and gets nothing until the next run: {why}")),
        });
    }

    /// Ends the sinks and closes the journal; a sentence if something could not be written.
    pub(crate) fn finish(mut self) -> Option<String> {
        // What is on the disk goes to the sinks, and then their cursors to the disk.
        self.journal.settle(SETTLE);
        for name in self.sinks.runner.stop() {
            eprintln!("note: sink `{name}` did not end in time; what it has not kept comes to it in the next run");
        }
        let durable = self.journal.durable();
        match self.journal.close() {
            0 => None,
            left => Some(format!("the journal is incomplete: {left} records after number {durable} were not written")),
        }
    }
}

/// A sink in `latchwork status`.
fn status(sink: &latchwork_sink::Status) -> serde_json::Value {
    let mut row = serde_json::json!({
        "name": sink.name, "kind": sink.kind, "state": sink.state.name(), "cursor": sink.cursor, "behind": sink.behind,
        "error": sink.error,
    });
    if let Some(version) = &sink.version {
        row["component"] = version.component.clone().into();
        row["hash"] = version.hash.clone().into();
    }
    row
}
