//! `journal.json`: which journal the numbers in the files are of. Each journal counts from 1: a number of another one says nothing.

use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::Path;

const FILE: &str = "journal.json";

/// Whose numbers these are.
#[derive(Default)]
pub(crate) struct Whose {
    /// Identity; empty where there is no such file.
    pub(crate) journal: String,
    /// Files that other journals have begun, and how long they were then: what stands before that is theirs.
    pub(crate) earlier: BTreeMap<String, u64>,
}

impl Whose {
    pub(crate) fn read(folder: &Path) -> Result<Self, String> {
        let path = folder.join(FILE);
        let no = |e: &dyn std::fmt::Display| format!("{} cannot be read: {e}", path.display());
        let bytes = match std::fs::read(&path) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Self::default()),
            bytes => bytes.map_err(|e| no(&e))?,
        };
        let json: Value = serde_json::from_slice(&bytes).map_err(|e| no(&e))?;
        let earlier = json["earlier"].as_object().into_iter().flatten();
        let earlier = earlier.filter_map(|(name, length)| Some((name.clone(), length.as_u64()?))).collect();
        Ok(Self { journal: json["journal"].as_str().unwrap_or_default().to_owned(), earlier })
    }

    /// Beside it first: there is never half a file.
    pub(crate) fn replace(&self, folder: &Path) -> Result<(), String> {
        let (path, draft) = (folder.join(FILE), folder.join("journal.json.new"));
        let write = || {
            let mut file = File::create(&draft)?;
            writeln!(file, "{:#}", json!({ "journal": self.journal, "earlier": self.earlier }))?;
            file.sync_all()?;
            drop(file);
            std::fs::rename(&draft, &path)?;
            File::open(folder)?.sync_all()
        };
        write().map_err(|e: std::io::Error| format!("{} cannot be replaced: {e}", path.display()))
    }
}
