//! One file: a header line, the states as text, and room up to a whole block of the file system.
//!
//! ```text
//! latchwork-retained 1 GENERATION LENGTH SHA-256
//! {"versions":[…],
//! "blocks":[…]}
//! ```
//!
//! The checksum is over the header before it and the text, so that no half of a writing over an older one is taken for a
//! whole. The length makes the file's own length mean nothing: a shorter state is written over a longer one without
//! cutting the file, which would be one more writing.

use crate::Retained;
use sha2::{Digest, Sha256};
use std::fmt::Write;

/// What the file system writes at least, bytes.
pub const BLOCK: usize = 4096;
/// More than any plant retains, bytes; what is longer is something else.
pub const LONGEST: usize = 64 << 20;

const MAGIC: &str = "latchwork-retained";
const FORMAT: &str = "1";
/// Most bytes that a header may have.
const HEADER: usize = 256;

/// Why a file is not taken.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Damage {
    /// It has no byte: it was made and never written.
    #[error("it is empty")]
    Empty,
    /// It does not begin as it should.
    #[error("it does not begin as a file of retained state")]
    Header,
    /// It has a format that this version does not know.
    #[error("it has format {found}; this version of Latchwork reads format {FORMAT}")]
    Format {
        /// What it says.
        found: String,
    },
    /// Its end is missing.
    #[error("it ends after {found} bytes of text; expected {expected}")]
    Short {
        /// Bytes behind the header.
        found: usize,
        /// What the header says.
        expected: usize,
    },
    /// It is not what was written.
    #[error("its checksum does not fit: a writing was cut off, or the disk has lost something")]
    Checksum,
    /// It is what was written, and makes no sense.
    #[error("its text makes no sense: {why}")]
    Text {
        /// Why.
        why: String,
    },
    /// It is too long to be one.
    #[error("it is longer than {LONGEST} bytes")]
    Long,
    /// The system does not give it.
    #[error("it cannot be read: {why}")]
    Unreadable {
        /// Why.
        why: String,
    },
}

/// The bytes of a file; a whole number of blocks.
///
/// # Errors
/// A sentence: more than [`LONGEST`] bytes.
pub fn encode(generation: u64, retained: &Retained) -> Result<Vec<u8>, String> {
    let text = retained.to_text().map_err(|e| e.to_string())?;
    let head = format!("{MAGIC} {FORMAT} {generation} {} ", text.len());
    let mut bytes = format!("{head}{}\n{text}", digest(head.as_bytes(), text.as_bytes())).into_bytes();
    if bytes.len() > LONGEST {
        return Err(format!("the state of all blocks is {} bytes; {LONGEST} are the most", bytes.len()));
    }
    bytes.resize(bytes.len().next_multiple_of(BLOCK), b'\n');
    Ok(bytes)
}

/// Generation and states of a file.
///
/// # Errors
/// Why it is not taken.
pub fn decode(bytes: &[u8]) -> Result<(u64, Retained), Damage> {
    if bytes.is_empty() {
        return Err(Damage::Empty);
    }
    if bytes.len() > LONGEST {
        return Err(Damage::Long);
    }
    let end = bytes.iter().take(HEADER).position(|b| *b == b'\n').ok_or(Damage::Header)?;
    let header = std::str::from_utf8(&bytes[..end]).map_err(|_| Damage::Header)?;
    let words: Vec<_> = header.split(' ').collect();
    let [MAGIC, format, generation, length, sum] = words[..] else { return Err(Damage::Header) };
    if format != FORMAT {
        return Err(Damage::Format { found: format.chars().filter(|c| !c.is_control()).collect() });
    }
    let (Ok(generation), Ok(length)) = (generation.parse::<u64>(), length.parse::<usize>()) else {
        return Err(Damage::Header);
    };
    let rest = &bytes[end + 1..];
    let text = rest.get(..length).ok_or(Damage::Short { found: rest.len(), expected: length })?;
    if digest(&bytes[..end - sum.len()], text) != sum {
        return Err(Damage::Checksum);
    }
    let retained = Retained::from_text(text).map_err(|why| Damage::Text { why })?;
    Ok((generation, retained))
}

fn digest(head: &[u8], text: &[u8]) -> String {
    let digest = Sha256::new().chain_update(head).chain_update(text).finalize();
    digest.iter().fold(String::new(), |mut hex, byte| {
        // Writing to a String never fails.
        let _ = write!(hex, "{byte:02x}");
        hex
    })
}
