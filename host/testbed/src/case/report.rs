//! What a run of tests found, for people and for scripts.

use latchwork_image::{format_duration, plain};
use serde::Serialize;
use std::fmt::Write;

/// One case.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct CaseReport {
    /// Its name.
    pub name: String,
    /// Line of the file, from 1.
    pub line: usize,
    /// Everything was as expected.
    pub passed: bool,
    /// Steps that were done.
    pub steps: usize,
    /// Executions of the block.
    pub executions: u64,
    /// Plant time that passed, ns.
    pub time_ns: u64,
    /// Steps that were not as expected, the first [`super::FAILURES`] of them.
    pub failures: Vec<Failure>,
    /// Further ones.
    pub more_failures: u64,
}

/// One step that was not as expected.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct Failure {
    /// Which: `step 2`, `bounds.csv:3`, `start`.
    pub step: String,
    /// Line of the file, from 1.
    pub line: usize,
    /// When, ns since the start of the case.
    pub at_ns: u64,
    /// What was not as expected.
    pub mismatches: Vec<Mismatch>,
    /// What was there before and after.
    pub timeline: Timeline,
}

/// One thing that was not as expected.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Mismatch {
    /// `outputs.q`, `alarms`, `state.hours`, `fault`, `refused`.
    pub what: String,
    /// What was expected.
    pub expected: String,
    /// What was found.
    pub got: String,
}

/// Inputs and outputs around a failure: the executions that changed something.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Timeline {
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Rows in the order of time.
    pub rows: Vec<TimelineRow>,
}

/// One execution.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct TimelineRow {
    /// When, ns since the start of the case.
    #[serde(rename = "at-ns")]
    pub at: u64,
    /// Values by column.
    pub values: Vec<String>,
    /// The execution that was not as expected.
    pub failed: bool,
}

impl Failure {
    /// For a person, each line indented by `indent` spaces; nothing of it acts on a terminal, whatever a block says.
    pub fn render(&self, indent: usize) -> String {
        let pad = " ".repeat(indent);
        let mut out = format!("{pad}{} (line {}) at {}\n", plain(&self.step), self.line, format_duration(self.at_ns));
        let width = self.mismatches.iter().map(|m| m.what.chars().count()).max().unwrap_or(0);
        for Mismatch { what, expected, got } in &self.mismatches {
            // Writing to a String never fails.
            let line = plain(&format!("{what:width$}  expected {expected}, got {got}"));
            let _ = writeln!(out, "{pad}  {line}");
        }
        if !self.timeline.rows.is_empty() {
            out.push('\n');
            self.timeline.render(&mut out, &pad);
        }
        out
    }
}

impl Timeline {
    fn render(&self, out: &mut String, pad: &str) {
        let head = std::iter::once("time".to_owned()).chain(self.columns.iter().map(|c| plain(c))).collect::<Vec<_>>();
        let rows: Vec<Vec<String>> = self
            .rows
            .iter()
            .map(|r| std::iter::once(format_duration(r.at)).chain(r.values.iter().map(|v| plain(v))).collect())
            .collect();
        let width = |column: usize| {
            let cells = rows.iter().chain([&head]).filter_map(|r: &Vec<String>| r.get(column));
            cells.map(|c| c.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..head.len()).map(width).collect();
        let line = |cells: &[String]| {
            let cells = cells.iter().zip(&widths).enumerate().map(|(n, (cell, width))| match n {
                0 => format!("{cell:>width$}"),
                _ => format!("{cell:width$}"),
            });
            cells.collect::<Vec<_>>().join("  ")
        };
        let _ = writeln!(out, "{pad}    {}", line(&head).trim_end());
        for (row, cells) in self.rows.iter().zip(&rows) {
            let mark = if row.failed { '>' } else { ' ' };
            let _ = writeln!(out, "{pad}  {mark} {}", line(cells).trim_end());
        }
    }
}
