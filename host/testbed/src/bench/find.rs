//! Where the component of a bench is.

use super::BenchError;
use crate::case::built;
use std::path::{Path, PathBuf};

/// The file of a component, by its name or path.
pub(super) fn find(name: &str) -> Result<PathBuf, BenchError> {
    if name.ends_with(".wasm") {
        let path = PathBuf::from(name);
        return if path.is_file() {
            Ok(path)
        } else {
            Err(BenchError::NotFound { name: name.into(), searched: vec![path] })
        };
    }
    let given = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from);
    let mut searched: Vec<_> = given
        .iter()
        .flat_map(|t| [t.join("components"), t.join("test-components")])
        .chain(built(Path::new(".")))
        .collect();
    searched.push(PathBuf::from("."));
    let file = format!("{name}.wasm");
    let found = searched.iter().map(|f| f.join(&file)).find(|p| p.is_file());
    found.ok_or_else(|| BenchError::NotFound { name: name.into(), searched })
}
