//! What was saved of which block.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// What a state was saved by; blocks of one component share it.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Version {
    /// Full name of the class.
    pub class: String,
    /// Component, its file's name without `.wasm`.
    pub component: String,
    /// SHA-256 of it, hex.
    pub hash: String,
    /// Names and types of the fields in the order of the cells, as `latchwork_block::upgrade::schema` tells them.
    pub schema: String,
}

/// The state of one block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Saved {
    /// What it was saved by.
    pub version: Arc<Version>,
    /// Plant time at which it was first saved with these values, ns.
    pub time: u64,
    /// The same as ns since 1970.
    pub wall: u64,
    /// One per field.
    pub cells: Box<[u64]>,
}

impl Saved {
    /// True when it holds the same state, whenever it was saved.
    pub fn same_state(&self, other: &Self) -> bool {
        self.cells == other.cells && self.version == other.version
    }
}

/// The states of all blocks, by name. Cheap to clone.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Retained {
    /// By the block's name.
    pub blocks: BTreeMap<String, Arc<Saved>>,
}

impl Retained {
    /// True when it holds the same states, whenever they were saved.
    pub fn same_states(&self, other: &Self) -> bool {
        let pairs = || self.blocks.iter().zip(&other.blocks);
        self.blocks.len() == other.blocks.len() && pairs().all(|(a, b)| a.0 == b.0 && a.1.same_state(b.1))
    }

    /// As text: versions once, then the blocks, a line each.
    pub(crate) fn to_text(&self) -> Result<String, serde_json::Error> {
        let mut numbers: HashMap<&Version, usize> = HashMap::new();
        let mut text = String::from("{\"versions\":[");
        for saved in self.blocks.values() {
            let next = numbers.len();
            if *numbers.entry(&saved.version).or_insert(next) == next {
                text += if next == 0 { "\n" } else { ",\n" };
                text += &serde_json::to_string(&*saved.version)?;
            }
        }
        text += "],\n\"blocks\":[";
        for (at, (name, saved)) in self.blocks.iter().enumerate() {
            text += if at == 0 { "\n" } else { ",\n" };
            let row = Row {
                name: name.clone(),
                version: numbers[&*saved.version],
                time: saved.time,
                wall: saved.wall,
                cells: saved.cells.clone(),
            };
            text += &serde_json::to_string(&row)?;
        }
        text += "]}\n";
        Ok(text)
    }

    /// From that text, or why it is none.
    pub(crate) fn from_text(text: &[u8]) -> Result<Self, String> {
        let body: Body = serde_json::from_slice(text).map_err(|e| e.to_string())?;
        let versions: Vec<_> = body.versions.into_iter().map(Arc::new).collect();
        let mut retained = Self::default();
        for Row { name, version, time, wall, cells } in body.blocks {
            let Some(version) = versions.get(version).cloned() else {
                return Err(format!("`{name}` has version {version} of {}", versions.len()));
            };
            retained.blocks.insert(name, Arc::new(Saved { version, time, wall, cells }));
        }
        Ok(retained)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Body {
    versions: Vec<Version>,
    blocks: Vec<Row>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    name: String,
    version: usize,
    #[serde(rename = "time-ns")]
    time: u64,
    #[serde(rename = "wall-ns")]
    wall: u64,
    cells: Box<[u64]>,
}
