//! What a block is told, one step after the other.

/// A story: settings, a time to begin at, steps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sequence {
    /// One cell per setting.
    pub(super) settings: Vec<u64>,
    /// Plant time of the first execution, ns.
    pub(super) start: u64,
    pub(super) steps: Vec<Step>,
}

/// Executions with the same inputs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Step {
    /// Before the first of them, the state is saved and another instance goes on from it.
    pub(super) restart: bool,
    /// Settings that are written before the first of them.
    pub(super) settings: Option<Vec<u64>>,
    /// Cells of the inputs, each signal's quality behind its value.
    pub(super) inputs: Vec<u64>,
    /// For the first of them.
    pub(super) commands: u64,
    /// Since the execution before, ns; the same for all of them. The first ever and the first after a restart are told 0.
    pub(super) elapsed: u64,
    /// How many, at least 1.
    pub(super) repeat: u32,
}

/// What shrinking has made of a sequence.
#[derive(Clone, Debug)]
pub(super) struct Shrunk {
    pub(super) sequence: Sequence,
    /// Nothing more can be left out, as far as was tried: the time for it was not over before.
    pub(super) smallest: bool,
}

impl Sequence {
    /// Executions of all steps.
    pub(super) fn executions(&self) -> u64 {
        self.steps.iter().map(|s| u64::from(s.repeat)).sum()
    }

    /// What is left when nothing after one execution of a step happens.
    pub(super) fn until(&self, step: usize, execution: u32) -> Self {
        let mut cut = self.clone();
        cut.steps.truncate(step + 1);
        if let Some(last) = cut.steps.last_mut() {
            last.repeat = execution + 1;
        }
        cut
    }

    /// Time that an execution of a step is told as passed.
    pub(super) fn elapsed(&self, step: usize, execution: u32) -> u64 {
        let step_ = &self.steps[step];
        if execution == 0 && (step == 0 || step_.restart) { 0 } else { step_.elapsed }
    }

    /// The steps once and again, up to at least so many executions.
    pub(super) fn looped(&self, executions: u64) -> Self {
        let times = executions.div_ceil(self.executions().max(1));
        let steps = (0..times).flat_map(|_| self.steps.iter().cloned()).collect();
        Self { steps, ..self.clone() }
    }
}
