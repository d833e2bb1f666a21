//! What an operator wants.

use crate::operate::Refused;
use std::sync::Arc;

/// Executions of the probation of a block, if nothing is said.
pub const PROBATION: u64 = 1000;
/// Batches of the probation of a sink, if nothing is said: where records are rare each is a batch of its own and comes late, and
/// a sink that has taken so many has opened, written and gone on.
pub const SINK_PROBATION: u64 = 3;

/// The probation of a block or `sink.NAME`, if nothing is said: executions, or batches.
pub fn usual_probation(block: &str) -> u64 {
    if block.starts_with(super::sinks::SINK) { SINK_PROBATION } else { PROBATION }
}

/// A swap: one block or several of one lane, all or none, in one scan.
#[derive(Clone, Debug, PartialEq)]
pub struct SwapOrder {
    /// What becomes what.
    pub parts: Vec<Part>,
    /// Executions for which the candidate runs in the shadow of the running block first; 0: none.
    pub shadow: u64,
    /// Deviations of real outputs that the shadow does not count as differences.
    pub tolerances: Vec<Tolerance>,
    /// Executions after the exchange within which a fault puts the old version back; of a sink, batches of records.
    pub probation: u64,
    /// Retained fields whose values do not fit the new type are clamped instead of refusing the swap.
    pub allow_lossy: bool,
    /// Only the plan, nothing is changed.
    pub dry_run: bool,
    /// When probation has passed, the component goes into the plant's folder and its name into the plant file.
    pub save: bool,
}

/// One block and its next version.
#[derive(Clone, PartialEq)]
pub struct Part {
    /// Block, or `sink.NAME`.
    pub block: String,
    /// Name of the component's file, for records and `--save`; no path.
    pub file: String,
    /// The component.
    pub bytes: Arc<[u8]>,
    /// Settings of the new version that are to be others than now: name and value as text.
    pub settings: Vec<(String, String)>,
    /// Hash of the component that it takes the place of, as a plan told; none: of whichever runs.
    pub expects: Option<String>,
}

/// Largest component, bytes.
const LARGEST: usize = 64 << 20;

impl Part {
    /// Refuses what nobody would want compiled.
    ///
    /// # Errors
    /// The component has more than 64 MiB.
    pub(super) fn not_too_large(&self) -> Result<(), Refused> {
        if self.bytes.len() <= LARGEST {
            return Ok(());
        }
        let (found, most) = (self.bytes.len() >> 20, LARGEST >> 20);
        let message = format!("`{}` has {found} MiB; a component of up to {most} MiB is taken", self.file);
        Err(Refused::new("value", message))
    }

    /// Refuses to take the place of another component than was expected.
    ///
    /// # Errors
    /// `runs`, a hash, is another one.
    pub(super) fn takes_place_of(&self, runs: &str) -> Result<(), Refused> {
        match &self.expects {
            Some(expected) if expected != runs => {
                let short = |hash: &str| hash.get(..12).unwrap_or(hash).to_owned();
                let (block, runs, expected) = (&self.block, short(runs), short(expected));
                let message = format!(
                    "`{block}` runs {runs} by now, not {expected} as when this was planned; look at the plan again with \
                     --dry-run"
                );
                Err(Refused::new("state", message))
            }
            _ => Ok(()),
        }
    }
}

impl std::fmt::Debug for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Part").field("block", &self.block).field("file", &self.file).finish_non_exhaustive()
    }
}

/// Which earlier version is to run again.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WayBack {
    /// So many versions back, from 1, in the order in which they were replaced: the version that a rollback replaces is the
    /// last one from then on.
    Steps(u64),
    /// The one whose component has a hash that begins so, hex in small letters.
    To(String),
}

/// How far an output may be off.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// Tag of an output, or a glob of them: `unit.outputs.level`.
    pub tag: String,
    /// Largest deviation, in the port's own unit.
    pub within: f64,
}
