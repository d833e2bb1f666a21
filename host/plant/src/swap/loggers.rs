//! What the status tells of the components of sinks: what runs, since when, by whom, and whether the plant file says so.

use super::sinks::SINK;
use crate::assemble::Plant;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The versions of a sink of kind `component`.
#[derive(Default)]
pub(super) struct Logger {
    /// Hash of the component that the plant file names: at the plant's start, or since it was saved.
    of_file: String,
    /// Since when it runs what it runs, ns since 1970; `None`: since the plant's start.
    since: Option<u64>,
    /// By hash: who brought it last. What nobody brought is the plant file's.
    by: BTreeMap<String, String>,
}

impl Plant {
    /// The sinks begin with what the plant file names.
    pub(super) fn know_loggers(&mut self) {
        let Some(sinks) = &self.swaps.sinks else { return };
        let of_file = |name: &str| Some((format!("{SINK}{name}"), sinks.version(name)?.hash));
        let logger = |(name, of_file)| (name, Logger { of_file, ..Logger::default() });
        self.swaps.loggers = sinks.names().filter_map(of_file).map(logger).collect();
    }

    /// Another component gets the records of `sink.NAME` from plant time `now`, ns, on. `brought` is its hash and who has
    /// brought it; none: an earlier one is back.
    pub(super) fn logger_changed(&mut self, sink: &str, brought: Option<(String, String)>, now: u64) {
        let since = self.router.epoch().saturating_add(now);
        let logger = self.swaps.loggers.entry(sink.into()).or_default();
        logger.since = Some(since);
        logger.by.extend(brought);
    }

    /// The plant file names this component of `sink.NAME` now.
    pub(super) fn logger_saved(&mut self, sink: &str, hash: String) {
        self.swaps.loggers.entry(sink.into()).or_default().of_file = hash;
    }

    /// Completes the rows of sinks in the status that have a component.
    pub(crate) fn logger_rows(&self, rows: &mut Value) {
        for row in rows.as_array_mut().into_iter().flatten() {
            let (Some(name), Some(hash)) = (row["name"].as_str(), row["hash"].as_str()) else { continue };
            let (sink, hash) = (format!("{SINK}{name}"), hash.to_owned());
            let Some(logger) = self.swaps.loggers.get(&sink) else { continue };
            row["since"] = json!(logger.since.unwrap_or(self.router.epoch()));
            row["by"] = json!(logger.by.get(&hash).map_or("", String::as_str));
            row["differs"] = json!(hash != logger.of_file);
            if let Some(swap) = self.swaps.of_sinks.iter().find(|s| s.name == sink && !s.status.stage.ended()) {
                row["swap"] = json!(swap.state());
            }
        }
    }
}
