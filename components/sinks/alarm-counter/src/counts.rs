//! `counts.json`: how often each alarm made each transition, and up to which record that was counted.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

const FILE: &str = "counts.json";

/// The counts in a directory.
pub(crate) struct Counts {
    folder: PathBuf,
    content: Content,
}

#[derive(Clone, Default, Deserialize, Serialize)]
struct Content {
    /// Identity of the journal that the number is of; empty where the plant did not say.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    journal: String,
    /// Number of the last alarm that was counted.
    seq: u64,
    /// Source, transition, times.
    counts: BTreeMap<String, BTreeMap<String, u64>>,
}

impl Counts {
    /// Goes on from what is there; from nothing where there is no file. The number of another journal counts for nothing; what
    /// was counted stays.
    pub(crate) fn open(folder: &Path, journal: &str) -> Result<Self, String> {
        let path = folder.join(FILE);
        let mut content = match std::fs::read(&path) {
            Ok(bytes) => serde_json::from_slice(&bytes)
                .map_err(|e| format!("{} is damaged: {e}; move it away to count from nothing", path.display()))?,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound && folder.is_dir() => Content::default(),
            Err(e) => {
                return Err(format!(
                    "{} cannot be read: {e}; alarm-counter needs a `directory` in the plant file",
                    path.display()
                ));
            }
        };
        if content.journal != journal {
            (content.journal, content.seq) = (journal.to_owned(), 0);
        }
        Ok(Self { folder: folder.to_owned(), content })
    }

    /// Number of the last alarm that was counted.
    pub(crate) fn seq(&self) -> u64 {
        self.content.seq
    }

    /// Counts alarms that were not counted yet, in the order of their numbers; on disk, all of them or none.
    pub(crate) fn add<'a>(&mut self, alarms: impl Iterator<Item = (u64, &'a str, &'a str)>) -> Result<(), String> {
        let mut next = None;
        for (seq, source, transition) in alarms {
            let next = next.get_or_insert_with(|| self.content.clone());
            next.seq = seq;
            let counts = next.counts.entry(source.into()).or_default().entry(transition.into()).or_default();
            *counts = counts.saturating_add(1);
        }
        if let Some(next) = next {
            self.replace(&next)?;
            self.content = next;
        }
        Ok(())
    }

    /// Beside it first: there is never half a file.
    fn replace(&self, content: &Content) -> Result<(), String> {
        let (path, draft) = (self.folder.join(FILE), self.folder.join("counts.json.new"));
        let json = serde_json::to_string_pretty(content).map_err(|e| format!("no JSON: {e}"))?;
        let write = || {
            let mut file = File::create(&draft)?;
            file.write_all(json.as_bytes())?;
            file.write_all(b"\n")?;
            file.sync_all()?;
            drop(file);
            std::fs::rename(&draft, &path)?;
            // The new name must outlive a power failure, too.
            File::open(&self.folder)?.sync_all()
        };
        write().map_err(|e: std::io::Error| format!("{} cannot be replaced: {e}", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_go_on_where_they_stood() {
        let folder = tempfile::tempdir().unwrap();
        let mut counts = Counts::open(folder.path(), "").unwrap();
        counts.add([(3, "a.alarms.high", "raised"), (5, "a.alarms.high", "returned")].into_iter()).unwrap();
        let mut again = Counts::open(folder.path(), "").unwrap();
        assert_eq!(again.seq(), 5);
        again.add([(9, "a.alarms.high", "raised")].into_iter()).unwrap();
        let json: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.path().join(FILE)).unwrap()).unwrap();
        assert_eq!(json, serde_json::json!({"seq": 9, "counts": {"a.alarms.high": {"raised": 2, "returned": 1}}}));
    }

    #[test]
    fn the_number_of_another_journal_hides_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let add = |journal: &str, seq| {
            let mut counts = Counts::open(folder.path(), journal).unwrap();
            let before = counts.seq();
            counts.add([(seq, "a.alarms.high", "raised")].into_iter()).unwrap();
            (before, counts.content.counts["a.alarms.high"]["raised"])
        };
        assert_eq!([add("one", 7), add("one", 9), add("two", 2), add("two", 3)], [(0, 1), (7, 2), (0, 3), (2, 4)]);
    }

    #[test]
    fn a_directory_that_is_missing_and_a_file_that_is_damaged_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let error = |path: &Path| Counts::open(path, "").err().unwrap();
        assert!(error(&folder.path().join("none")).contains("needs a `directory`"));
        std::fs::write(folder.path().join(FILE), "{\"seq\": 3").unwrap();
        assert!(error(folder.path()).contains("is damaged"));
    }
}
