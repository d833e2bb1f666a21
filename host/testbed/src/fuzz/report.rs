//! What a search found.

use latchwork_block::FaultKind;
use serde::Serialize;

/// What is wrong with a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// It faults.
    Fault(FaultKind),
    /// An execution takes longer than its budget.
    Budget,
    /// Its memory grows for ever.
    Growth,
    /// Two instances that are told the same differ.
    NotDeterministic,
    /// After a restart it goes on otherwise than without: something is missing in `retained`.
    NotRestored,
    /// `save` changes it.
    SaveDisturbs,
    /// Settings that it refused change it.
    RefusalDisturbs,
}

impl Kind {
    /// All kinds, as a user names them.
    pub const ALL: [Self; 12] = [
        Self::Fault(FaultKind::Trap),
        Self::Fault(FaultKind::Memory),
        Self::Fault(FaultKind::Stack),
        Self::Fault(FaultKind::Result),
        Self::Fault(FaultKind::Instantiate),
        Self::Fault(FaultKind::Settings),
        Self::Budget,
        Self::Growth,
        Self::NotDeterministic,
        Self::NotRestored,
        Self::SaveDisturbs,
        Self::RefusalDisturbs,
    ];

    /// Name in reports: of a fault its own, else `budget`, `memory-growth`, `not-deterministic`, `not-restored`,
    /// `save-disturbs`, `refusal-disturbs`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fault(kind) => kind.name(),
            Self::Budget => "budget",
            Self::Growth => "memory-growth",
            Self::NotDeterministic => "not-deterministic",
            Self::NotRestored => "not-restored",
            Self::SaveDisturbs => "save-disturbs",
            Self::RefusalDisturbs => "refusal-disturbs",
        }
    }
}

impl Serialize for Kind {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// One thing that is wrong, with the smallest story found that shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct Finding {
    /// What.
    pub kind: Kind,
    /// In a sentence.
    pub message: String,
    /// Number of the sequence that showed it first, from 1.
    pub sequence: u64,
    /// Executions of that sequence.
    pub executions_found: u64,
    /// Executions of the smallest that shows it.
    pub executions: u64,
    /// Nothing more can be left out of that one, as far as was tried; false where the time for it was over before.
    pub smallest: bool,
    /// The smallest as a case of a test file, which fails until the block is mended; `None` where no case can show it.
    pub case: Option<String>,
}

/// What a search found and how far it went.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct Report {
    /// The class, with its version.
    pub class: String,
    /// The same seed makes the same sequences.
    pub seed: u64,
    /// Sequences that were tried, without those of shrinking.
    pub sequences: u64,
    /// Executions of the block.
    pub executions: u64,
    /// Restarts that were compared.
    pub restarts: u64,
    /// Settings that the block took.
    pub settings_taken: u64,
    /// Settings that it refused.
    pub settings_refused: u64,
    /// Half of all executions took no longer, ns of the machine's clock. 0 where the clock is too coarse.
    pub median_ns: u64,
    /// Longest execution that the same sequence repeated three times, ns.
    pub worst_ns: u64,
    /// Most linear memory, bytes.
    pub memory: u64,
    /// What is wrong, one of a kind.
    pub findings: Vec<Finding>,
    /// Other things to know.
    pub notes: Vec<String>,
    /// Head of a test file for the cases of the findings; the component's place is yet to be said.
    #[serde(skip)]
    pub(super) head: String,
}

impl Report {
    /// A test file with a case for each finding that a case can show. `component`: a path that ends in .wasm, relative to
    /// where the file will be, or a name.
    pub fn test_file(&self, component: &str) -> Option<String> {
        let cases: Vec<&str> = self.findings.iter().filter_map(|f| f.case.as_deref()).collect();
        let component = toml::Value::from(component);
        (!cases.is_empty()).then(|| format!("component = {component}\n{}\n{}", self.head, cases.join("\n")))
    }
}
