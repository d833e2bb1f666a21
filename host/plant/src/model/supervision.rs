//! What the supervision is told besides records of single things.

use super::TagRef;

/// `[table.NAME]`: the full state of a group of tags.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StatusTable {
    /// Name.
    pub name: String,
    /// Its tags, in the order of their names.
    pub tags: Vec<TagRef>,
    /// Shortest time between two records, ns.
    pub every: u64,
}

/// `[heartbeat]`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Heartbeat {
    /// Period of the plant's own, ns.
    pub send: Option<u64>,
    /// Longest time without one of the supervision, ns.
    pub expect: Option<u64>,
}

/// `[recorder]`
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recording {
    /// Blocks, by index.
    pub blocks: Vec<usize>,
    /// Most memory, bytes.
    pub memory: u64,
    /// Most room of its files, bytes.
    pub spill: u64,
    /// Time between two states of a block, ns.
    pub keyframe: u64,
}
