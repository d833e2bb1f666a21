//! `--data`: the retained state of a run.

use anyhow::Result;
use latchwork_image::format_duration;
use latchwork_plant::assemble::Plant;
use latchwork_retain::{Figures, Store, read};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;

/// Longest wait for the last writing.
const CLOSE: Duration = Duration::from_secs(10);

/// The retained state of a plant, and the thread that writes it.
pub(crate) struct Retention {
    store: Store,
    blocks: usize,
    every: u64,
}

/// What was written of it.
pub(crate) struct Written {
    figures: Figures,
    blocks: usize,
    every: u64,
}

/// Names of the blocks that retain something.
fn names(plant: &Plant) -> impl Iterator<Item = &str> {
    plant.model.blocks.iter().filter(|b| b.retain).map(|b| b.name.as_str())
}

impl Retention {
    /// Opens the files in a folder and gives the plant what is in them; `None` for a plant that neither retains anything nor
    /// has ever done so.
    pub(crate) fn open(folder: &Path, plant: &mut Plant) -> Result<Option<Self>> {
        let (blocks, every) = (names(plant).count(), plant.model.retain_every);
        if blocks == 0 {
            let found = read(folder);
            if found.generation == 0 && !found.lost() {
                return Ok(None);
            }
        }
        let (store, found) = Store::open(folder)?;
        plant.retain(&found, store.vault());
        Ok(Some(Self { store, blocks, every }))
    }

    /// What a run without a folder does not keep.
    pub(crate) fn note(plant: &Plant) {
        let names: Vec<_> = names(plant).map(|name| format!("`{name}`")).collect();
        if !names.is_empty() {
            let names = names.join(", ");
            eprintln!("note: the state of {names} does not outlive this run: there is no folder for it\n  help: add --data FOLDER");
        }
    }

    /// Waits until the last state is durable; a sentence if it is not.
    pub(crate) fn finish(self) -> (Written, Option<String>) {
        let Self { store, blocks, every } = self;
        let before = store.figures();
        let (figures, error) = match store.close(CLOSE) {
            Ok(figures) => (figures, None),
            Err(why) => (before, Some(why)),
        };
        (Written { figures, blocks, every }, error)
    }
}

impl Written {
    /// One line of the summary.
    pub(crate) fn text(&self) -> String {
        let Figures { writes, bytes, .. } = self.figures;
        let a_day = match self.figures.bytes_a_day(self.every) {
            Some(bytes) => format!(", {} a day with a round every {}", size(bytes), format_duration(self.every)),
            None => String::new(),
        };
        format!("retained state of {} blocks: {writes} writings, {}{a_day}", self.blocks, size(bytes))
    }

    /// The same for scripts.
    pub(crate) fn json(&self) -> Value {
        let Figures { rounds, writes, bytes, .. } = self.figures;
        json!({
            "blocks": self.blocks, "every-ns": self.every, "rounds": rounds, "writes": writes, "bytes": bytes,
            "bytes-a-day": self.figures.bytes_a_day(self.every),
        })
    }
}

/// Bytes with the unit that makes a short number.
fn size(bytes: u64) -> String {
    match bytes {
        0..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}
