//! A status table: the full state of a group of tags whenever one of them has changed.

use latchwork_image::{Quality, TagId, TagTable, Type, Value, View};
use latchwork_record::{Draft, Kind};
use serde_json::{Map, json};

/// A status table with what it said last.
pub(crate) struct Table {
    source: String,
    tags: Vec<(String, Type)>,
    view: View,
    last: Option<Vec<(u64, Quality)>>,
    every: u64,
    /// Plant time before which it is not looked at, ns.
    next: u64,
}

impl Table {
    /// A table of tags, as `view` shows them.
    pub(crate) fn new(name: &str, ids: &[TagId], all: &TagTable, view: View, every: u64) -> Self {
        let tag = |id: &TagId| (all.get(*id).name.clone(), all.get(*id).ty.clone());
        let tags = ids.iter().map(tag).collect();
        Self { source: format!("table.{name}"), tags, view, last: None, every, next: 0 }
    }

    /// The record of the table at plant time `now`, ns, if it has changed.
    pub(crate) fn look(&mut self, now: u64) -> Option<Draft> {
        if now < self.next {
            return None;
        }
        self.view.refresh();
        let values: Vec<_> = (0..self.tags.len()).map(|n| (self.view.cell(n), self.view.quality(n))).collect();
        if self.last.as_ref() == Some(&values) {
            return None;
        }
        self.next = now.saturating_add(self.every);
        let row = |((name, ty), (cell, quality)): (&(String, Type), &(u64, Quality))| {
            (name.clone(), json!({ "value": ty.value(*cell), "quality": quality.name() }))
        };
        let state: Map<_, _> = self.tags.iter().zip(&values).map(row).collect();
        self.last = Some(values);
        let mut draft = Draft::new(now, Kind::Event, &self.source, "changed");
        draft.current = Value::Text(serde_json::Value::Object(state).to_string());
        Some(draft)
    }
}
