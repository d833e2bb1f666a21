//! Which files are tested.

use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};

/// How test files end.
const ENDING: &str = ".test.toml";
/// Folders within folders that are searched.
const DEPTH: usize = 16;

/// The files, and those in the folders, by name; `target` and hidden folders hold none.
pub(super) fn find(given: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in given {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let before = files.len();
        search(path, DEPTH, &mut files)?;
        if files.len() == before {
            bail!("there is no file *{ENDING} in {}", path.display());
        }
        files[before..].sort();
    }
    Ok(files)
}

fn search(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) -> Result<()> {
    let cannot = || format!("the folder {} cannot be read", folder.display());
    for entry in std::fs::read_dir(folder).with_context(cannot)? {
        let entry = entry.with_context(cannot)?;
        let (name, path) = (entry.file_name().to_string_lossy().into_owned(), entry.path());
        // Links are not followed into folders: there may be circles.
        let kind = entry.file_type().with_context(cannot)?;
        if kind.is_dir() {
            if depth > 0 && name != "target" && !name.starts_with('.') {
                search(&path, depth - 1, files)?;
            }
        } else if name.ends_with(ENDING) {
            files.push(path);
        }
    }
    Ok(())
}
