//! The last executions of a case, and the timeline of a failure from them.

use super::report::{Mismatch, Timeline, TimelineRow};
use latchwork_block::{Class, Port};
use latchwork_image::Quality;
use std::collections::VecDeque;

/// Executions that changed something and are shown before the one that failed, and after it.
const BEFORE: usize = 5;
const AFTER: usize = 2;
/// Most columns.
const COLUMNS: usize = 8;

/// The last executions that changed something.
#[derive(Default)]
pub struct History {
    rows: VecDeque<Row>,
    open: Vec<Open>,
}

#[derive(Clone)]
struct Row {
    at: u64,
    cells: Vec<u64>,
    failed: bool,
}

/// A failure that still waits for what comes after it.
struct Open {
    rows: Vec<Row>,
    /// Ports it speaks of.
    named: Vec<String>,
    left: usize,
    /// Which failure it is.
    failure: usize,
}

impl History {
    /// Notes an execution, if it changed anything.
    #[inline]
    pub fn note(&mut self, at: u64, cells: &[u64]) {
        if self.rows.back().is_none_or(|row| row.cells != cells) {
            self.add(at, cells);
        }
    }

    fn add(&mut self, at: u64, cells: &[u64]) {
        // The oldest row's memory serves again.
        let mut row = match self.rows.len() {
            n if n > BEFORE => self.rows.pop_front(),
            _ => None,
        }
        .unwrap_or(Row { at, cells: Vec::new(), failed: false });
        row.at = at;
        row.cells.clear();
        row.cells.extend_from_slice(cells);
        for open in self.open.iter_mut().filter(|o| o.left > 0) {
            open.left -= 1;
            open.rows.push(row.clone());
        }
        self.rows.push_back(row);
    }

    /// The execution at `at` failed.
    pub fn failed(&mut self, at: u64, cells: &[u64], mismatches: &[Mismatch], failure: usize) {
        let mut rows: Vec<Row> = self.rows.iter().cloned().collect();
        if rows.last().is_none_or(|r| r.at != at) {
            rows.push(Row { at, cells: cells.to_vec(), failed: true });
        }
        if let Some(row) = rows.last_mut() {
            row.failed = true;
        }
        let rows = rows.split_off(rows.len().saturating_sub(BEFORE + 1));
        let named = mismatches.iter().map(|m| m.what.clone()).collect();
        self.open.push(Open { rows, named, left: AFTER, failure });
    }

    /// All timelines so far, each with the failure it belongs to.
    pub fn close(&mut self, columns: &[Column<'_>]) -> Vec<(usize, Timeline)> {
        self.open.drain(..).map(|open| (open.failure, timeline(columns, &open.rows, &open.named))).collect()
    }

    /// Another instance begins: what was before is no part of its timelines.
    pub fn clear(&mut self) {
        self.rows.clear();
    }
}

/// A column: its name and how its text comes from the cells of a row.
pub struct Column<'a> {
    /// Name.
    pub name: String,
    /// What it shows.
    pub kind: Kind<'a>,
    /// Its cell; the quality of a signal follows it.
    pub cell: usize,
}

/// What a column shows.
pub enum Kind<'a> {
    /// A value.
    Port(&'a Port),
    /// The flags of a word that are on.
    Flags(&'a [String]),
}

impl Column<'_> {
    fn text(&self, cells: &[u64]) -> String {
        let value = cells[self.cell];
        match &self.kind {
            Kind::Port(port) => {
                let text = port.ty.format(value);
                match Quality::from_cell(cells[self.cell + usize::from(port.signal)]) {
                    quality if port.signal && quality != Quality::Good => format!("{text} {quality}"),
                    _ => text,
                }
            }
            Kind::Flags(names) => names_of(names, value),
        }
    }
}

/// Flags that are on, `-` for none.
pub(super) fn names_of(names: &[String], word: u64) -> String {
    let on: Vec<_> = names.iter().enumerate().filter(|(i, _)| word >> i & 1 == 1).map(|(_, n)| n.as_str()).collect();
    if on.is_empty() { "-".into() } else { on.join("|") }
}

/// The columns of a class: everything that goes in and comes out.
pub(super) fn columns(class: &Class) -> Vec<Column<'_>> {
    let mut columns = Vec::new();
    let mut cell = 0;
    let groups =
        [("inputs", &class.inputs, "commands", &class.commands), ("outputs", &class.outputs, "alarms", &class.alarms)];
    for (group, ports, word, flags) in groups {
        for port in ports {
            columns.push(Column { name: format!("{group}.{}", port.path), kind: Kind::Port(port), cell });
            cell += 1 + usize::from(port.signal);
        }
        if !flags.is_empty() {
            columns.push(Column { name: word.into(), kind: Kind::Flags(flags), cell });
            cell += 1;
        }
    }
    columns
}

/// All columns where there is room for all; otherwise those that are spoken of, then those that change.
fn timeline(all: &[Column<'_>], rows: &[Row], named: &[String]) -> Timeline {
    let texts: Vec<Vec<String>> = rows.iter().map(|r| all.iter().map(|c| c.text(&r.cells)).collect()).collect();
    let changes = |i: usize| texts.iter().any(|r| r[i] != texts[0][i]);
    let is_named =
        |i: usize| named.iter().any(|n| *n == all[i].name || n.strip_suffix(".quality") == Some(&all[i].name));
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by_key(|i| (!is_named(*i), !changes(*i), *i));
    order.truncate(COLUMNS);
    order.sort_unstable();
    let rows = rows.iter().zip(&texts).map(|(row, texts)| TimelineRow {
        at: row.at,
        values: order.iter().map(|i| texts[*i].clone()).collect(),
        failed: row.failed,
    });
    Timeline { rows: rows.collect(), columns: order.iter().map(|i| all[*i].name.clone()).collect() }
}
