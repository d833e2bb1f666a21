//! What is told about a swap; as JSON it is what the API and `--json` give.

use latchwork_block::upgrade::{Field, PortChange};
pub use latchwork_testbed::replay::{Deviation, FailedRun};
use serde::{Deserialize, Serialize};

/// How far a swap is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stage {
    /// Loaded, checked, compiled, instantiated, configured, off the lanes.
    Preparing,
    /// The candidate runs in the shadow.
    Shadow,
    /// On its way to the lane.
    Exchanging,
    /// The new version runs, the old one waits.
    Probation,
    /// The new version runs for good.
    Done,
    /// A dry run has ended: nothing was changed.
    Planned,
    /// Nothing was changed, and the message says why.
    Refused,
    /// The new version failed, the old one runs again.
    RolledBack,
    /// An operator has called it off before the exchange.
    Cancelled,
}

impl Stage {
    /// It goes no further.
    pub fn ended(self) -> bool {
        !matches!(self, Self::Preparing | Self::Shadow | Self::Exchanging | Self::Probation)
    }
}

/// A swap and how far it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct SwapStatus {
    /// Its number since the plant's start, from 1.
    pub number: u64,
    /// Stage.
    pub stage: Stage,
    /// Why it was refused or rolled back, for a person; empty while all is well.
    pub message: String,
    /// By whom.
    pub user: String,
    /// When it was ordered, ns since 1970.
    pub asked: u64,
    /// What becomes what; empty until it is known.
    pub blocks: Vec<BlockPlan>,
    /// Executions that the shadow or the probation has still before it, of a sink batches; 0 once it has ended.
    pub left: u64,
    /// What the shadow has seen so far, one per block.
    pub shadow: Vec<ShadowReport>,
    /// Time that preparing took, ns.
    pub prepare_ns: u64,
    /// Time that the exchange took in the lane, ns; 0 before it.
    pub exchange_ns: u64,
    /// Plant time of the scan that was the new version's first, ns; 0 before it.
    pub exchanged_at: u64,
    /// Saved to the plant file; with `--save`.
    pub saved: bool,
}

/// A version of a block.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct Version {
    /// Component, its file's name without `.wasm`.
    pub component: String,
    /// SHA-256 of it, hex.
    pub hash: String,
    /// Size, bytes.
    pub size: u64,
    /// Full name of the class it is used as.
    pub class: String,
    /// What it imports.
    pub imports: Vec<String>,
    /// Call path: `plain` or `component`.
    pub path: String,
}

/// What a swap would change in one block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct BlockPlan {
    /// Block.
    pub block: String,
    /// What runs.
    pub old: Version,
    /// What would run.
    pub new: Version,
    /// Ports added, gone, changed in type.
    pub ports: Vec<PortChange>,
    /// Retained fields and what becomes of each.
    pub state: Vec<Field>,
    /// Settings and what becomes of each; new ones take the component's defaults.
    pub settings: Vec<Field>,
    /// Wires, rules, tables and other names of the plant file that would lead nowhere: each stops the swap.
    pub broken: Vec<String>,
    /// What else is worth knowing, in sentences: a cold start, a port without a tag, …
    pub notes: Vec<String>,
}

/// What the shadow of one block has seen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct ShadowReport {
    /// Block.
    pub block: String,
    /// Executions compared.
    pub executions: u64,
    /// Executions with a difference beyond tolerance.
    pub different: u64,
    /// Executions that found no room on the way to the shadow; any makes it worthless.
    pub missed: u64,
    /// Per output or alarm that was ever different.
    pub deviations: Vec<Deviation>,
    /// The candidate's fault, which ended it.
    pub fault: Option<FailedRun>,
    /// Mean and longest execution of the running block, ns, and of the candidate.
    pub running_mean_ns: u64,
    /// Longest.
    pub running_max_ns: u64,
    /// Mean of the candidate.
    pub candidate_mean_ns: u64,
    /// Longest of the candidate.
    pub candidate_max_ns: u64,
}
