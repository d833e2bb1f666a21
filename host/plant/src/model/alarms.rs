//! Alarms and commands: the rules of the plant file, and what they made of each variable.

use super::{TagRef, Wire};
use latchwork_alarm::CodeKind;

/// `[[alarm]]`: what the variables that it matches are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AlarmRule {
    /// `match`, as it is written.
    pub pattern: String,
    /// Line of the plant file, from 1.
    pub line: usize,
    /// Kind of the variables.
    pub code: CodeKind,
    /// Priority of their records.
    pub priority: u8,
    /// How long a condition must stand, ns.
    pub on_delay: u64,
    /// How long a condition must be away, ns.
    pub off_delay: u64,
    /// While this is true the alarms are suppressed by design.
    pub suppress: Option<Wire>,
    /// How many variables took it.
    pub matched: usize,
}

/// An alarm or command variable, or a bool tag that a rule made an alarm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variable {
    /// The tag.
    pub tag: TagRef,
    /// Its full name.
    pub name: String,
    /// Its rule, if one matches.
    pub rule: Option<usize>,
    /// Sentence for its records; may be empty.
    pub text: String,
    /// Group in which the first alarm is told from those that follow.
    pub group: Option<String>,
}

impl Variable {
    /// True for a command of a block.
    pub fn is_command(&self) -> bool {
        matches!(self.tag, TagRef::Command { .. })
    }
}
