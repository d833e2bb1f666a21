//! `latchwork alarms report DIR`

mod html;
mod json;
mod plot;
mod words;

use super::deliver;
use crate::Exit;
use crate::args::{Report as Args, ReportFormat};
use anyhow::Result;
use globset::{Glob, GlobSet, GlobSetBuilder};
use latchwork_alarm::State;
use latchwork_alarm::report::{Collector, Event, Report};
use latchwork_record::Kind;
use latchwork_record::journal::{Filter, Reader};
use std::collections::HashMap;

pub(super) fn execute(args: &Args) -> Result<Exit> {
    // Nothing is known of the future, and time in which nothing can have happened makes every rate smaller.
    let now = u64::try_from(jiff::Timestamp::now().as_nanosecond()).unwrap_or(u64::MAX);
    let to = args.to.map(|to| to.min(now));
    if let (Some(from), Some(to)) = (args.from, to)
        && from >= to
    {
        eprintln!(
            "error: there is no time from {} to {}\n  help: --from must be before --to, and not in the future",
            words::moment(from),
            words::moment(to)
        );
        return Ok(Exit::Usage);
    }
    let found = read(args, to)?;
    let text = match args.format {
        ReportFormat::Table => words::table(&found),
        ReportFormat::Json => json::document(&found)? + "\n",
        ReportFormat::Html => html::document(&found)?,
    };
    deliver(&text, args.output.as_deref())?;
    Ok(Exit::Fine)
}

/// A report, and what else there is to know.
struct Found {
    /// The folder of the journal.
    journal: String,
    report: Report,
    /// The beginning of its period was asked for.
    from_asked: bool,
}

fn read(args: &Args, to: Option<u64>) -> Result<Found> {
    let reader = Reader::open(&args.folder)?;
    let mut choice = Choice::new(args)?;
    let mut collector = Collector::new(args.from);
    // What was before the period tells how the alarms stood when it began.
    reader.glance(Filter { to: to.unwrap_or(u64::MAX), ..Filter::default() }, |record| {
        if record.kind == Kind::Alarm && choice.takes(record.source) {
            collector.take(&Event {
                time: record.time,
                alarm: record.source,
                transition: record.transition,
                state: record.text.and_then(State::from_name),
                priority: record.priority,
            });
            return;
        }
        // Others tell what a sink has not had; the journal had it.
        if record.kind == Kind::Lost && record.transition == "overflow" {
            let count = record.number.and_then(|n| u64::try_from(n).ok()).unwrap_or(0);
            collector.missing(record.time, count);
        } else {
            collector.moment(record.time);
        }
    })?;
    let (journal, from_asked) = (args.folder.display().to_string(), args.from.is_some());
    Ok(Found { journal, report: collector.finish(to), from_asked })
}

/// Which alarms the report is about.
struct Choice {
    only: Option<GlobSet>,
    exclude: GlobSet,
    /// What was decided, by name.
    known: HashMap<Box<str>, bool>,
}

impl Choice {
    fn new(args: &Args) -> Result<Self> {
        let set = |globs: &[Glob]| {
            let mut set = GlobSetBuilder::new();
            globs.iter().for_each(|glob| {
                set.add(glob.clone());
            });
            set.build()
        };
        let only = if args.only.is_empty() { None } else { Some(set(&args.only)?) };
        Ok(Self { only, exclude: set(&args.exclude)?, known: HashMap::new() })
    }

    fn takes(&mut self, alarm: &str) -> bool {
        if self.only.is_none() && self.exclude.is_empty() {
            return true;
        }
        if let Some(known) = self.known.get(alarm) {
            return *known;
        }
        let takes = self.only.as_ref().is_none_or(|only| only.is_match(alarm)) && !self.exclude.is_match(alarm);
        self.known.insert(alarm.into(), takes);
        takes
    }
}
