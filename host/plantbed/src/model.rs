//! A test file of a plant that was read and found right.

use latchwork_block::Engine;
use latchwork_image::{Quality, Type};
use latchwork_plant::model::Model;
use latchwork_plant::operate::Operation;
use latchwork_testbed::case::kit::Expected;
use std::path::PathBuf;

/// A test file of a plant, ready to run.
pub struct PlantTest {
    /// Where it is.
    pub path: PathBuf,
    /// The plant.
    pub model: Model,
    /// The cases in the order of the file.
    pub cases: Vec<Case>,
    pub(crate) engine: Engine,
}

/// One case.
#[derive(Debug)]
pub struct Case {
    /// Name.
    pub name: String,
    /// Line of the file, from 1.
    pub line: usize,
    /// Tags that the case speaks of, each with its type: two cells each, value and quality.
    pub(crate) watched: Vec<(String, Type)>,
    /// Input points at the start.
    pub(crate) inputs: Vec<Input>,
    /// In the place of those of the plant file.
    pub(crate) settings: Vec<(String, u64)>,
    pub(crate) steps: Vec<Step>,
}

/// What an input point shows from now on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Input {
    pub(crate) tag: String,
    /// Its value; `None`: as it is.
    pub(crate) cell: Option<u64>,
    pub(crate) quality: Quality,
}

/// What a moment changes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Changes {
    /// Input points.
    pub(crate) inputs: Vec<Input>,
    /// In their order.
    pub(crate) wishes: Vec<Operation>,
}

/// One step.
#[derive(Debug, Default)]
pub(crate) struct Step {
    /// For the report: `step 2`, `row 3 of bounds.csv`, with its name.
    pub(crate) label: String,
    pub(crate) line: usize,
    /// Since the start of the case, ns.
    pub(crate) at: u64,
    pub(crate) restart: bool,
    pub(crate) changes: Changes,
    pub(crate) expect: Expect,
}

/// What is expected at the end of a step.
#[derive(Debug, Default)]
pub(crate) struct Expect {
    /// Cells are those of the case's watched tags.
    pub(crate) outputs: Vec<Expected>,
    /// All that are listed.
    pub(crate) alarms: Option<Vec<String>>,
    /// State by alarm.
    pub(crate) states: Vec<(String, String)>,
    pub(crate) records: Vec<String>,
    pub(crate) refused: Option<String>,
    pub(crate) faults: Vec<String>,
}
