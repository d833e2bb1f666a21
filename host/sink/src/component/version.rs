//! Which component a logger is.

use super::imports;
use latchwork_block::Component;
use std::path::Path;

/// A component of a sink.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Version {
    /// Its file's name without `.wasm`.
    pub component: String,
    /// SHA-256, hex.
    pub hash: String,
    /// Bytes.
    pub size: u64,
    /// What it imports, besides types.
    pub imports: Vec<String>,
}

impl Version {
    /// Of the bytes of a file.
    ///
    /// # Errors
    /// Why they are no logger, with the way out.
    pub fn read(file: &str, bytes: &[u8]) -> Result<Self, String> {
        let imports = imports::check(bytes).map_err(|(message, help)| format!("{file}: {message}; {help}"))?;
        let component = Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { component, hash: Component::hash_of(bytes), size: bytes.len() as u64, imports })
    }
}
