//! `latchwork journal verify`, `latchwork journal export`

use crate::Exit;
use crate::args::{Export, Format, Journal, JournalCommand, VerifyJournal};
use crate::report;
use anyhow::{Context, Result};
use latchwork_image::Value;
use latchwork_record::journal::{Filter, Reader, Verdict, verify};
use latchwork_record::{Record, rfc3339};
use serde_json::json;
use std::borrow::Cow;
use std::fs::File;
use std::io::{BufWriter, IsTerminal, Write};

/// Records read at once.
const PAGE: usize = 10_000;
/// Holes that are named; the rest is counted.
const NAMED: usize = 10;

pub(super) fn execute(args: &Journal) -> Result<Exit> {
    match &args.command {
        JournalCommand::Verify(args) => check(args),
        JournalCommand::Export(args) => export(args),
    }
}

fn check(args: &VerifyJournal) -> Result<Exit> {
    let shows = !args.json && std::io::stderr().is_terminal();
    let verdict = verify(&args.folder, |n| {
        if shows && n % 500_000 < 10_000 {
            eprint!("\r{n} records …");
        }
    })?;
    if shows {
        eprint!("\r");
    }
    if args.json {
        let hole =
            |h: &latchwork_record::journal::Hole| json!({ "from": h.from, "to": h.to, "explained": h.explained });
        let holes: Vec<_> = verdict.holes.iter().map(hole).collect();
        let (first, last) = verdict.numbers.unzip();
        let found = json!({
            "good": verdict.is_good(), "records": verdict.records, "first": first, "last": last, "holes": holes,
            "damage": verdict.damage,
        });
        report::say(&format!("{}\n", serde_json::to_string_pretty(&found)?));
    } else {
        report::say(&text(&verdict));
    }
    Ok(if verdict.is_good() { Exit::Fine } else { Exit::Wanting })
}

fn text(verdict: &Verdict) -> String {
    let mut out = match verdict.numbers {
        Some((first, last)) => format!("{} records, numbers {first} to {last}\n", verdict.records),
        None => "no records\n".into(),
    };
    for hole in verdict.holes.iter().take(NAMED) {
        let what = if hole.from == hole.to {
            format!("number {}", hole.from)
        } else {
            format!("numbers {} to {}", hole.from, hole.to)
        };
        let why = if hole.explained { "a `lost` record says so" } else { "NOTHING SAYS WHY" };
        out += &format!("missing: {what}; {why}\n");
    }
    if verdict.holes.len() > NAMED {
        out += &format!("missing: {} more ranges\n", verdict.holes.len() - NAMED);
    }
    for line in &verdict.damage {
        out += &format!("damaged: {line}\n");
    }
    out + if verdict.is_good() { "good\n" } else { "NOT good\n" }
}

fn export(args: &Export) -> Result<Exit> {
    let reader = Reader::open(&args.folder)?;
    let mut filter = Filter { from: args.from.unwrap_or(0), to: args.to.unwrap_or(u64::MAX), ..Filter::default() };
    let target = args.output.as_ref().map_or("the output".into(), |path| path.display().to_string());
    let failed = || format!("{target} could not be written");
    let file = args.output.as_ref().map(File::create).transpose().with_context(failed)?;
    let out: Box<dyn Write> = match &file {
        Some(file) => Box::new(file.try_clone().with_context(failed)?),
        None => Box::new(std::io::stdout().lock()),
    };
    let mut count = 0;
    let mut writer = Rows::new(args.format, out).with_context(failed)?;
    loop {
        let page = reader.records(filter, PAGE)?;
        let Some(last) = page.last() else { break };
        filter.after = last.seq;
        for record in &page {
            writer.row(record).with_context(failed)?;
        }
        count += page.len();
    }
    writer.finish().with_context(failed)?;
    if let Some(file) = file {
        // A stick may be drawn as soon as this program has ended.
        file.sync_all().with_context(failed)?;
        eprintln!("{count} records in {target}");
    }
    Ok(Exit::Fine)
}

/// A text that a spreadsheet takes for a formula gets a `'` before it: names and texts come from anywhere, and what is opened in
/// an office shall not do anything there.
fn harmless(text: &str) -> Cow<'_, str> {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) { format!("'{text}").into() } else { text.into() }
}

enum Rows {
    Csv(Box<csv::Writer<Box<dyn Write>>>),
    Lines(BufWriter<Box<dyn Write>>),
}

impl Rows {
    fn new(format: Format, out: Box<dyn Write>) -> Result<Self> {
        Ok(match format {
            Format::Jsonl => Self::Lines(BufWriter::new(out)),
            Format::Csv => {
                let mut csv = csv::Writer::from_writer(out);
                csv.write_record([
                    "seq",
                    "time",
                    "kind",
                    "source",
                    "transition",
                    "previous",
                    "current",
                    "priority",
                    "user",
                    "text",
                ])?;
                Self::Csv(Box::new(csv))
            }
        })
    }

    fn row(&mut self, r: &Record) -> Result<()> {
        match self {
            Self::Lines(out) => writeln!(out, "{}", r.to_json())?,
            Self::Csv(csv) => {
                let value = |v: &Value| match v {
                    Value::None => String::new(),
                    Value::Text(text) => harmless(text).into_owned(),
                    other => other.to_string(),
                };
                csv.write_record([
                    &r.seq.to_string(),
                    &rfc3339(r.time),
                    r.kind.name(),
                    &harmless(&r.source),
                    &harmless(&r.transition),
                    &value(&r.previous),
                    &value(&r.current),
                    &r.priority.to_string(),
                    &harmless(&r.user),
                    &harmless(&r.text),
                ])?;
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<()> {
        match self {
            Self::Lines(mut out) => out.flush()?,
            Self::Csv(mut csv) => csv.flush()?,
        }
        Ok(())
    }
}
