//! What an operator is told.

use crate::swap::SwapStatus;
use serde::Serialize;
use serde_json::Value;

/// A tag with its value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TagRow {
    /// Name.
    pub tag: String,
    /// Type, as `latchwork tags` prints it.
    #[serde(rename = "type")]
    pub ty: String,
    /// Value.
    pub value: Value,
    /// `good`, `uncertain` or `bad`.
    pub quality: &'static str,
    /// An operator holds it.
    pub forced: bool,
}

/// An alarm with its state.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct AlarmRow {
    /// Full name of its variable.
    pub alarm: String,
    /// Text of its rule.
    pub text: String,
    /// State, in one word: `unacknowledged`, `active`, `returned`, …
    pub state: &'static str,
    /// Priority, 0 to 255.
    pub priority: u8,
    /// Its code with the bits of run time.
    pub code: u16,
    /// Group, or empty.
    pub group: String,
    /// It came first in its group.
    pub first_out: bool,
    /// The condition is there now, whatever hides it.
    pub condition: bool,
    /// Quality of the condition; `bad` where its block or device is out of order, and the condition is the last one known.
    pub quality: &'static str,
    /// When it was raised last, ns since 1970; 0: never.
    pub raised: u64,
    /// Until when it is shelved, ns since 1970; 0: it is not.
    pub shelved_until: u64,
    /// Number of the record of its last transition; 0: none.
    pub seq: u64,
}

/// A force.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ForceRow {
    /// Tag that was named.
    pub tag: String,
    /// Value.
    pub value: Value,
    /// By whom.
    pub user: String,
    /// Since when, ns since 1970.
    pub since: u64,
}

/// The answer to an operation.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Answer {
    /// Tags.
    Tags(Vec<TagRow>),
    /// Alarms.
    Alarms(Vec<AlarmRow>),
    /// Forces.
    Forces(Vec<ForceRow>),
    /// How the plant is.
    Status(Value),
    /// A recording, as a file of the flight recorder.
    Recording(Vec<u8>),
    /// A swap that was ordered.
    Swap(Box<SwapStatus>),
    /// Swaps.
    Swaps(Vec<SwapStatus>),
    /// It is done; one sentence per thing that was done.
    Done {
        /// Sentences.
        done: Vec<String>,
    },
}

/// Why a wish does not come true.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("{message}")]
pub struct Refused {
    /// In one word, for scripts: `unknown`, `forbidden`, `value`, `state`, `busy`, `gone`.
    pub reason: &'static str,
    /// For a person: what was found, what was expected, the way out.
    pub message: String,
}

impl Refused {
    /// A refusal.
    pub fn new(reason: &'static str, message: impl Into<String>) -> Self {
        Self { reason, message: message.into() }
    }
}
