//! What is told about two versions that were given the same; as JSON it is what the API and `--json` give.

use latchwork_block::Class;
use latchwork_image::{Quality, Type, format_duration};
use serde::{Deserialize, Serialize};

/// An output or alarm that was different.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct Deviation {
    /// `outputs.PORT` or `alarms.NAME`.
    pub port: String,
    /// Executions with a difference beyond tolerance.
    pub count: u64,
    /// Plant time of the first, ns.
    pub first: u64,
    /// Largest deviation of a number, the largest number where one of both is not finite; 0 for others.
    pub worst: f64,
    /// Plant time of the worst (of others: of the first), ns.
    pub worst_at: u64,
    /// What the running block gave then.
    pub running: String,
    /// What the candidate gave then.
    pub candidate: String,
    /// The inputs and commands that caused it: name and value.
    pub inputs: Vec<(String, String)>,
}

/// A fault and what led to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct FailedRun {
    /// Kind: `trap`, `budget`, …
    pub kind: String,
    /// What happened.
    pub message: String,
    /// Plant time, ns.
    pub at: u64,
    /// The inputs and commands: name and value.
    pub inputs: Vec<(String, String)>,
}

/// Arguments by name, as a person reads them: inputs, a quality that is not good behind its value, and the commands that are
/// given.
pub fn named(class: &Class, arguments: &[u64]) -> Vec<(String, String)> {
    let (mut named, mut cells) = (Vec::new(), arguments.iter().copied());
    for port in &class.inputs {
        let mut value = port.ty.format(cells.next().unwrap_or(0));
        if port.signal {
            let quality = Quality::from_cell(cells.next().unwrap_or(0));
            if quality != Quality::Good {
                value += &format!(" ({})", quality.name());
            }
        }
        named.push((format!("inputs.{}", port.path), value));
    }
    if !class.commands.is_empty() {
        let given = Type::Flags(class.commands.clone().into()).format(cells.next().unwrap_or(0));
        named.push(("commands".into(), given));
    }
    named
}

/// What a replay of one block has found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub struct Replayed {
    /// Block.
    pub block: String,
    /// Run of the plant.
    pub run: u64,
    /// When plant time 0 was, ns since 1970; 0 at virtual time.
    pub epoch: u64,
    /// The component that was recorded.
    pub component: String,
    /// Its SHA-256, hex.
    pub hash: String,
    /// The one that was executed, if it is another one.
    pub with: Option<Other>,
    /// Plant time of the first execution that counts, ns.
    pub from: u64,
    /// Of the last one.
    pub to: u64,
    /// Executions run again that count.
    pub executions: u64,
    /// Recorded executions that could not be run: no state to begin with came before them.
    pub skipped: u64,
    /// Events that found no room in the recorder.
    pub missed: u64,
    /// SHA-256 over the time and the outputs of each execution, as recorded.
    pub recorded: String,
    /// The same as replayed.
    pub replayed: String,
    /// Executions, settings and states with a difference (beyond tolerance, with another component).
    pub different: u64,
    /// Per output or alarm that was ever different.
    pub deviations: Vec<Deviation>,
    /// A fault that was not in the recording.
    pub fault: Option<FailedRun>,
    /// What else is worth knowing, in sentences.
    pub notes: Vec<String>,
}

/// A component.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Other {
    /// Name.
    pub component: String,
    /// SHA-256, hex.
    pub hash: String,
}

impl Replayed {
    /// The same component gave the same bits, or another one what the tolerances allow, at least once.
    pub fn equal(&self) -> bool {
        let bits = self.with.is_some() || self.recorded == self.replayed;
        self.executions > 0 && self.different == 0 && self.fault.is_none() && bits
    }

    /// Each sentence once.
    pub(super) fn note(&mut self, note: String) {
        if self.notes.len() < NOTES && !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}

/// Most sentences.
const NOTES: usize = 20;

/// A plant time as it is shown.
pub(super) fn clock(time: u64) -> String {
    format_duration(time)
}
