//! How a search goes, and how far it is.

use super::report::Kind;

/// How to search.
#[derive(Clone, Debug)]
pub struct Options {
    /// The same seed makes the same sequences.
    pub seed: u64,
    /// Sequences to try; `None`: until the time is over.
    pub sequences: Option<u64>,
    /// Time to search by the clock, ns, of which shrinking what was found gets at most a half; however late it is, 256 executions
    /// or 16 sequences are tried. Without this and `sequences` a thousand sequences are.
    pub time: Option<u64>,
    /// Longest execution, ns.
    pub budget: u64,
    /// Most linear memory, bytes.
    pub memory: u64,
    /// Period of the engine's ticker, ns.
    pub tick: u64,
    /// What is meant to be so, and is not told.
    pub ignored: Vec<Kind>,
}

impl Default for Options {
    /// A thousand sequences of seed 0; a budget of 1 ms, 4 MiB; a ticker of 10 ms.
    fn default() -> Self {
        Self {
            seed: 0,
            sequences: None,
            time: None,
            budget: 1_000_000,
            memory: 4 << 20,
            tick: 10_000_000,
            ignored: Vec::new(),
        }
    }
}

/// How far a search is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Since its begin, ns of the clock.
    pub time: u64,
    /// Sequences tried.
    pub sequences: u64,
    /// Executions done.
    pub executions: u64,
    /// Things found.
    pub findings: usize,
}
