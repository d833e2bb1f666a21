//! Swaps as an engineer does them: real processes in real time, over the socket, with files that are saved and kills at any moment.

mod candidates;
mod kills;
#[path = "../operate/support.rs"]
mod support;
mod swaps;

use std::path::{Path, PathBuf};
use support::{Running, target};

/// A shipped component in another version: the same but for a custom section that says which. `name` is its file's.
fn version(folder: &Path, of: &str, name: &str) -> PathBuf {
    let mut bytes = std::fs::read(target().join("components").join(format!("{of}.wasm"))).expect("a component");
    let payload = [&[7][..], b"version", name.as_bytes()].concat();
    bytes.extend([0, u8::try_from(payload.len()).expect("a short name")]);
    bytes.extend(payload);
    let path = folder.join(format!("{name}.wasm"));
    std::fs::write(&path, bytes).expect("a file");
    path
}

/// What the status says of a block.
fn row(plant: &Running, block: &str) -> serde_json::Value {
    let status = plant.json(&["status"]);
    let rows = status["blocks"].as_array().expect("blocks");
    rows.iter().find(|r| r["name"] == block).expect("the block").clone()
}

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}
