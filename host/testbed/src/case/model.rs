//! A test file that was read and found right: everything resolved to cells.

use latchwork_block::{Class, Component, Limits, Template};
use latchwork_image::{Quality, Type};
use std::path::PathBuf;
use std::sync::Arc;

/// A test file, ready to run.
#[derive(Debug)]
pub struct TestFile {
    /// Where it is.
    pub path: PathBuf,
    /// What is tested.
    pub subject: Subject,
    /// The cases in the order of the file.
    pub cases: Vec<Case>,
    /// Longest execution, ns of the machine's clock.
    pub budget: u64,
    /// Most memory, bytes.
    pub memory: u64,
}

impl TestFile {
    /// Limits of an instance, for an engine that ticks once in `tick` ns.
    pub fn limits(&self, tick: u64) -> Limits {
        Limits { memory: self.memory, budget_ticks: self.budget.div_ceil(tick.max(1)) + 1, ..Limits::default() }
    }
}

/// A component, the class that is tested, its code.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Component.
    pub component: Component,
    /// Class.
    pub class: Arc<Class>,
    /// Compiled.
    pub template: Template,
}

/// One case.
#[derive(Debug)]
pub struct Case {
    /// Name.
    pub name: String,
    /// Line of the file, from 1.
    pub line: usize,
    pub(super) every: u64,
    pub(super) start: u64,
    pub(super) first: Option<bool>,
    pub(super) elapsed: u64,
    /// By setting.
    pub(super) settings: Vec<Option<u64>>,
    pub(super) inputs: Vec<SetCell>,
    /// By field, when a state is given.
    pub(super) state: Option<Vec<Option<u64>>>,
    pub(super) refused: Option<String>,
    pub(super) fault: Option<String>,
    pub(super) steps: Vec<Step>,
}

impl Case {
    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.steps.len()
    }
}

/// A cell and what is written to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetCell {
    /// Index of the cell.
    pub cell: usize,
    /// What is written.
    pub value: u64,
}

/// What takes another instance.
#[derive(Debug, Default)]
pub(super) enum Takeover {
    #[default]
    None,
    Restart,
    Swap {
        to: Box<Subject>,
        lossy: bool,
    },
}

/// One step.
#[derive(Debug, Default)]
pub(super) struct Step {
    /// For the report: `step 2`, `row 3 of bounds.csv`, with its name.
    pub(super) label: String,
    pub(super) line: usize,
    /// Since the start, ns.
    pub(super) at: u64,
    pub(super) takeover: Takeover,
    /// By setting.
    pub(super) settings: Vec<(usize, u64)>,
    pub(super) inputs: Vec<SetCell>,
    pub(super) commands: u64,
    pub(super) expect: Expect,
}

/// What is expected after an execution.
#[derive(Debug, Default)]
pub(super) struct Expect {
    pub(super) outputs: Vec<Expected>,
    pub(super) state: Vec<Expected>,
    /// Bits of alarms that are spoken of, and which of them are on.
    pub(super) alarms: Option<(u64, u64)>,
    pub(super) refused: Option<String>,
    pub(super) fault: Option<String>,
}

impl Expect {
    /// Something is expected that only an execution can show.
    pub(super) fn looks(&self) -> bool {
        !self.outputs.is_empty() || !self.state.is_empty() || self.alarms.is_some()
    }
}

/// One expected value.
#[derive(Debug)]
pub struct Expected {
    /// `outputs.q`
    pub name: String,
    /// Type of the value.
    pub ty: Type,
    /// Index of the output cell, or of the field.
    pub cell: usize,
    /// The value, if any is expected.
    pub value: Option<u64>,
    /// For numbers, in their own unit; of durations in ns.
    pub within: f64,
    /// In the cell behind the value.
    pub quality: Option<Quality>,
}
