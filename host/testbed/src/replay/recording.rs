//! A recording as a whole: a file, or a folder of files that follow each other.

use super::file::{ENDING, Found, RecordingError};
use super::{Segment, file};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// A recording.
#[derive(Debug, Default)]
pub struct Recording {
    /// Segments by run and block, in order.
    blocks: BTreeMap<(u64, String), Vec<Segment>>,
    /// Components by their hashes.
    components: HashMap<String, Vec<u8>>,
    /// What is damaged and was left out, in sentences.
    pub damage: Vec<String>,
}

impl Recording {
    /// Reads a file, or all files of a folder in the order of their names. What is torn or damaged is left out and said.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let mut found = Found::default();
        if path.is_dir() {
            for file in listed(path)? {
                match file.extension().and_then(|e| e.to_str()) {
                    Some(ENDING) => match found.read(&file) {
                        // The file that was being begun when the power went.
                        Err(RecordingError::Foreign { path }) => {
                            found.damage.push(format!("{}: it has no beginning; it is left out", path.display()));
                        }
                        // What another Latchwork has left there is no reason not to read the rest.
                        Err(error @ RecordingError::Version { .. }) => {
                            found.damage.push(format!("{error}; it is left out"))
                        }
                        other => other?,
                    },
                    Some("wasm") => {
                        let read = std::fs::read(&file);
                        found
                            .components
                            .push(read.map_err(|error| RecordingError::Read { path: file.clone(), error })?);
                    }
                    _ => {}
                }
            }
        } else {
            found.read(path)?;
        }
        let mut recording = Self { damage: found.damage, ..Self::default() };
        for segment in found.segments {
            let key = (segment.head.run, segment.head.block.clone());
            recording.blocks.entry(key).or_default().push(segment);
        }
        for segments in recording.blocks.values_mut() {
            segments.sort_by_key(|s| s.head.number);
            segments.dedup_by_key(|s| s.head.number);
        }
        for bytes in found.components {
            recording.components.insert(hash_of(&bytes), bytes);
        }
        if recording.blocks.is_empty() {
            let damage = recording.damage.iter().map(|d| format!("; {d}")).collect();
            return Err(RecordingError::Empty { path: path.into(), damage });
        }
        Ok(recording)
    }

    /// Runs in it, in order.
    pub fn runs(&self) -> Vec<u64> {
        let mut runs: Vec<_> = self.blocks.keys().map(|(run, _)| *run).collect();
        runs.dedup();
        runs
    }

    /// Blocks of a run, by name, each with its segments in order.
    pub fn blocks(&self, run: u64) -> impl Iterator<Item = (&str, &[Segment])> {
        self.blocks.iter().filter(move |((r, _), _)| *r == run).map(|((_, block), s)| (block.as_str(), s.as_slice()))
    }

    /// A component by its hash.
    pub fn component(&self, hash: &str) -> Option<&[u8]> {
        self.components.get(hash).map(Vec::as_slice)
    }

    /// The same as one file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = file::header();
        let mut components: Vec<_> = self.components.iter().collect();
        components.sort_unstable();
        components.iter().for_each(|(_, component)| bytes.extend(file::component_chunk(component)));
        self.blocks.values().flatten().for_each(|segment| bytes.extend(file::segment_chunk(segment)));
        bytes
    }
}

/// SHA-256, hex.
pub fn hash_of(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

fn listed(folder: &Path) -> Result<Vec<std::path::PathBuf>, RecordingError> {
    let error = |error| RecordingError::Read { path: folder.into(), error };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(error)? {
        files.push(entry.map_err(error)?.path());
    }
    files.sort();
    Ok(files)
}
