//! The file: a stream of chunks, each with its length and checksum, so that a torn end costs only what is torn.
//!
//! ```text
//! "LATCHREC" version (u32)   chunk*
//! chunk: kind (u8) length (u32) crc32 of what follows (u32) payload       all numbers little-endian
//! kind 1: a component's bytes    kind 2: a segment: length of its head (u32), head (JSON), events
//! ```

use super::Segment;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"LATCHREC";
/// Version of the format.
pub const VERSION: u32 = 2;
const COMPONENT: u8 = 1;
const SEGMENT: u8 = 2;
/// Ending of the files.
pub const ENDING: &str = "latchrec";

/// The beginning of a file.
pub fn header() -> Vec<u8> {
    [&MAGIC[..], &VERSION.to_le_bytes()].concat()
}

/// A segment as it stands in a file.
pub fn segment_chunk(segment: &Segment) -> Vec<u8> {
    chunk(SEGMENT, &segment.to_bytes())
}

/// A component as it stands in a file.
pub fn component_chunk(component: &[u8]) -> Vec<u8> {
    chunk(COMPONENT, component)
}

fn chunk(kind: u8, payload: &[u8]) -> Vec<u8> {
    // A component is no larger than its plant loads, a segment a fraction of that.
    let length = u32::try_from(payload.len()).unwrap_or(u32::MAX);
    let sum = crc32fast::hash(payload);
    [&[kind][..], &length.to_le_bytes(), &sum.to_le_bytes(), payload].concat()
}

/// Hashes of the components that a file's segments need, as far as they can be read; none of a file without a beginning.
pub fn components_of(path: &Path) -> Result<BTreeSet<String>, RecordingError> {
    let mut found = Found::default();
    match found.read(path) {
        Ok(()) | Err(RecordingError::Foreign { .. }) => {}
        Err(error) => return Err(error),
    }
    Ok(found.segments.into_iter().map(|segment| segment.head.hash).collect())
}

/// What was found in a file.
#[derive(Default)]
pub(super) struct Found {
    pub(super) segments: Vec<Segment>,
    pub(super) components: Vec<Vec<u8>>,
    /// What is damaged, in sentences.
    pub(super) damage: Vec<String>,
}

/// Why a file is no recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// It cannot be read.
    #[error("{}: {error}", path.display())]
    Read {
        /// File or folder.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// It is something else.
    #[error("{} is no recording: it does not begin with {}; expected a file or folder that the flight recorder wrote", path.display(), MAGIC.escape_ascii())]
    Foreign {
        /// File.
        path: PathBuf,
    },
    /// It was written by another Latchwork.
    #[error("{} has version {found} of the format; this Latchwork reads version {VERSION}: use the one that wrote it", path.display())]
    Version {
        /// File.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// There is nothing in it.
    #[error("{} holds no recorded block{damage}", path.display())]
    Empty {
        /// File or folder.
        path: PathBuf,
        /// What was damaged, or nothing.
        damage: String,
    },
}

impl Found {
    /// Reads a file; what is damaged is left out and said.
    pub(super) fn read(&mut self, path: &Path) -> Result<(), RecordingError> {
        let bytes = std::fs::read(path).map_err(|error| RecordingError::Read { path: path.into(), error })?;
        let foreign = || RecordingError::Foreign { path: path.into() };
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(foreign)?;
        let (version, rest) = rest.split_first_chunk().ok_or_else(foreign)?;
        let version = u32::from_le_bytes(*version);
        if version != VERSION {
            return Err(RecordingError::Version { path: path.into(), found: version });
        }
        self.chunks(rest, bytes.len() - rest.len(), &path.display().to_string());
        Ok(())
    }

    fn chunks(&mut self, mut rest: &[u8], mut at: usize, shown: &str) {
        while !rest.is_empty() {
            let Some((kind, payload, after)) = split(rest) else {
                self.damage
                    .push(format!("{shown}: torn at byte {at}; the {} bytes from there on are left out", rest.len()));
                return;
            };
            let problem = match (kind, payload) {
                (_, None) => Some("its checksum is wrong"),
                (COMPONENT, Some(bytes)) => {
                    self.components.push(bytes.to_vec());
                    None
                }
                (SEGMENT, Some(bytes)) => match Segment::from_bytes(bytes) {
                    Ok(segment) => {
                        self.segments.push(segment);
                        None
                    }
                    Err(damaged) => Some(damaged.0),
                },
                _ => Some("its kind is unknown"),
            };
            if let Some(problem) = problem {
                self.damage.push(format!("{shown}: the chunk at byte {at} is left out: {problem}"));
            }
            at += rest.len() - after.len();
            rest = after;
        }
    }
}

/// Kind, payload (`None` when its checksum is wrong) and what follows; `None` when it is not all there.
#[expect(clippy::type_complexity, reason = "three parts of one slice")]
fn split(bytes: &[u8]) -> Option<(u8, Option<&[u8]>, &[u8])> {
    let (kind, rest) = bytes.split_first()?;
    let (length, rest) = rest.split_first_chunk()?;
    let (sum, rest) = rest.split_first_chunk()?;
    let (payload, after) = rest.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
    let right = crc32fast::hash(payload) == u32::from_le_bytes(*sum);
    Some((*kind, right.then_some(payload), after))
}
