//! What is told about two versions that were given the same; as JSON it is what the API and `--json` give.

use latchwork_block::Class;
use latchwork_image::{Quality, Type};
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
