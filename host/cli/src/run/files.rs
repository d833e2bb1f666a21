//! `--trace` and `--records`: files that grow while the plant runs.
//!
//! An error of a file never stops a plant: the first one is kept and told at the end.

use anyhow::{Context, Result};
use latchwork_image::{TagId, Type};
use latchwork_plant::assemble::Plant;
use latchwork_plant::lane::Change;
use latchwork_record::Record;
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// What is written reaches the file at least this often, ns of plant time.
const FLUSH: u64 = 500_000_000;

struct Trace {
    path: String,
    out: csv::Writer<File>,
    lanes: Vec<String>,
    tags: HashMap<TagId, (String, Type)>,
    rows: u64,
}

/// The files of a run.
pub(crate) struct Files {
    trace: Option<Trace>,
    records: Option<(String, BufWriter<File>)>,
    flushed: u64,
    error: Option<String>,
}

fn create(path: &Path, what: &str) -> Result<(String, File)> {
    let shown = path.display().to_string();
    let file = File::create(path).with_context(|| format!("the {what} file {shown} cannot be written"))?;
    Ok((shown, file))
}

impl Files {
    /// Creates the files that were asked for.
    pub(crate) fn create(plant: &Plant, trace: Option<&Path>, records: Option<&Path>) -> Result<Self> {
        let trace = match trace {
            None => None,
            Some(path) => {
                let (path, file) = create(path, "trace")?;
                let mut out = csv::Writer::from_writer(file);
                out.write_record(["time_ns", "lane", "tag", "value"])
                    .with_context(|| format!("the trace file {path} cannot be written"))?;
                let lanes = plant.model.lanes.iter().map(|l| l.name.clone()).collect();
                let tags = plant.layout.tags.iter().map(|(id, t)| (id, (t.name.clone(), t.ty.clone()))).collect();
                Some(Trace { path, out, lanes, tags, rows: 0 })
            }
        };
        let records =
            records.map(|path| create(path, "records").map(|(path, file)| (path, BufWriter::new(file)))).transpose()?;
        Ok(Self { trace, records, flushed: 0, error: None })
    }

    pub(crate) fn change(&mut self, change: &Change) {
        let Some(trace) = &mut self.trace else { return };
        let Some((name, ty)) = trace.tags.get(&change.tag) else { return };
        let lane = trace.lanes.get(change.lane as usize).map_or("?", String::as_str);
        let (time, value) = (change.time.to_string(), ty.format(change.cell));
        trace.rows += 1;
        let written = trace.out.write_record([time.as_str(), lane, name, &value]);
        keep(&mut self.error, &trace.path, written.map_err(|e| e.to_string()));
    }

    pub(crate) fn record(&mut self, record: &Record) {
        let Some((path, out)) = &mut self.records else { return };
        let written = writeln!(out, "{}", record.to_json());
        keep(&mut self.error, path, written.map_err(|e| e.to_string()));
    }

    /// Now and then: hands over to the system what has gathered.
    pub(crate) fn tick(&mut self, now: u64) {
        if now.saturating_sub(self.flushed) >= FLUSH {
            self.flushed = now;
            self.flush();
        }
    }

    fn flush(&mut self) {
        if let Some(trace) = &mut self.trace {
            keep(&mut self.error, &trace.path, trace.out.flush().map_err(|e| e.to_string()));
        }
        if let Some((path, out)) = &mut self.records {
            keep(&mut self.error, path, out.flush().map_err(|e| e.to_string()));
        }
    }

    /// Rows of the trace, and the first error.
    pub(crate) fn finish(mut self) -> (u64, Option<String>) {
        self.flush();
        (self.trace.map_or(0, |t| t.rows), self.error)
    }
}

fn keep(error: &mut Option<String>, path: &str, result: Result<(), String>) {
    if let Err(e) = result
        && error.is_none()
    {
        *error = Some(format!("{path} is incomplete: {e}"));
    }
}
