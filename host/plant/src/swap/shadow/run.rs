//! One candidate, frame by frame.

use super::{Candidate, Progress, Verdict};
use crate::lane::{Frame, TapReader, TapState, Timer};
use crate::swap::ShadowReport;
use latchwork_block::upgrade::{Mapping, Transfer};
use latchwork_block::{Class, Fault, Instance, Scan};
use latchwork_testbed::replay::{Comparer, FailedRun, Tolerances, named};
use std::sync::Arc;

/// Frames handled before the progress is told.
const FRAMES: usize = 256;

/// A candidate and what it is compared with.
pub(super) struct Run {
    reader: TapReader,
    worker: Worker,
}

struct Worker {
    block: String,
    instance: Instance,
    running: Arc<Class>,
    timer: Option<Timer>,
    state: Transfer,
    settings: Transfer,
    own_settings: Vec<usize>,
    settings_cells: Vec<u64>,
    mapping: Mapping,
    /// Argument cells of the candidate, then its output cells.
    cells: Vec<u64>,
    ins: Vec<u32>,
    comparer: Comparer,
    started: bool,
    /// Its next execution is its first, because no state came with it.
    cold: bool,
    wanted: u64,
    executions: u64,
    different: u64,
    missed: u64,
    fault: Option<FailedRun>,
    /// Plant time of the last frame that had one, ns.
    last: u64,
    times: [Times; 2],
}

#[derive(Clone, Copy, Default)]
struct Times {
    sum: u64,
    longest: u64,
}

impl Times {
    fn add(&mut self, took: u64) {
        self.sum = self.sum.saturating_add(took);
        self.longest = self.longest.max(took);
    }
}

impl Run {
    pub(super) fn new(candidate: Candidate<'_>, within: &Tolerances, reader: TapReader, timer: Option<Timer>) -> Self {
        let Candidate { block, running, instance, settings, own_settings, lossy, executions, .. } = candidate;
        let class = instance.class();
        let arguments = class.argument_cells();
        let worker = Worker {
            state: Transfer::new(&running.retained, &class.retained, lossy),
            settings: Transfer::new(&running.settings, &class.settings, lossy),
            mapping: Mapping::new(&running, class),
            cells: vec![0; arguments + class.output_cells()],
            ins: (0..arguments as u32).collect(),
            comparer: Comparer::new(&running, class, |output| within.of(&block, output)),
            block,
            instance,
            running,
            timer,
            own_settings,
            settings_cells: settings,
            started: false,
            cold: false,
            wanted: executions.max(1),
            executions: 0,
            different: 0,
            missed: 0,
            fault: None,
            last: 0,
            times: Default::default(),
        };
        Self { reader, worker }
    }

    /// Handles what the tap has brought.
    pub(super) fn take(&mut self) -> Option<Verdict> {
        for _ in 0..FRAMES {
            let Some((missed, frame)) = self.reader.next_frame() else {
                let over = self.reader.is_over();
                return over.then(|| Verdict::Failed("the running block cannot be listened to any more".into()));
            };
            if let Some(verdict) = self.worker.frame(missed, frame) {
                return Some(verdict);
            }
        }
        None
    }

    /// Executions and missed ones so far: when it is still, there is nothing new to tell.
    pub(super) fn count(&self) -> u64 {
        self.worker.executions + self.worker.missed
    }

    pub(super) fn progress(&self, verdict: Option<Verdict>) -> Progress {
        let w = &self.worker;
        let mean = |t: Times| t.sum.checked_div(w.executions).unwrap_or(0);
        let report = ShadowReport {
            block: w.block.clone(),
            executions: w.executions,
            different: w.different,
            missed: w.missed,
            deviations: w.comparer.deviations(),
            fault: w.fault.clone(),
            running_mean_ns: mean(w.times[0]),
            running_max_ns: w.times[0].longest,
            candidate_mean_ns: mean(w.times[1]),
            candidate_max_ns: w.times[1].longest,
        };
        Progress { report, verdict, left: w.wanted.saturating_sub(w.executions) }
    }
}

impl Worker {
    fn frame(&mut self, missed: u32, frame: Frame<'_>) -> Option<Verdict> {
        let failed = |why: &str| Some(Verdict::Failed(why.into()));
        if missed > 0 {
            self.missed += u64::from(missed);
            let why =
                format!("the shadow was too slow and missed {missed} executions: try again when the machine has time");
            return Some(Verdict::Failed(why));
        }
        match frame {
            Frame::State { state: TapState::Absent, .. } => {
                failed("the running block is out of order: there is nothing to compare with")
            }
            Frame::State { state: TapState::Unsaved, .. } => {
                failed("the running block cannot be saved: there is no state for the candidate to begin with")
            }
            // Another state of a block that is followed already tells nothing new.
            Frame::State { .. } if self.started => None,
            Frame::State { state, last } => {
                (self.started, self.last) = (true, last);
                self.restore(state).and_then(|fault| self.fails(&fault, "took the running block's state", None))
            }
            Frame::Execution { outputs: Err(_), .. } => failed("the running block has faulted meanwhile"),
            Frame::Restarted => failed("the running block was restarted meanwhile"),
            Frame::Waits | Frame::Ended => failed("the running block was exchanged or let go meanwhile"),
            Frame::Execution { scan, took, arguments, outputs: Ok(outputs) } => {
                self.execute(scan, took, arguments, outputs)
            }
            Frame::Settings { taken: Ok(false), .. } => None,
            Frame::Settings { taken: Err(_), .. } => {
                failed("the running block has faulted over its settings meanwhile")
            }
            Frame::Settings { cells, .. } => self.configure(cells),
        }
    }

    /// The state of the running block, by name; fields that are new keep what the candidate starts with.
    fn restore(&mut self, state: TapState<'_>) -> Option<Fault> {
        let TapState::Retained(cells) = state else { return None };
        self.cold = cells.is_empty() || self.instance.class().retained.is_empty();
        if self.cold {
            return None;
        }
        let restored = self.instance.save().and_then(|own| {
            let mut own = own.unwrap_or_default();
            self.state.apply(cells, &mut own);
            self.instance.restore(&own)
        });
        restored.err()
    }

    fn execute(&mut self, scan: Scan, took: u64, arguments: &[u64], outputs: &[u64]) -> Option<Verdict> {
        self.last = scan.now;
        let own = self.ins.len();
        self.mapping.arguments(arguments, &mut self.cells[..own]);
        // As a cold start in the lane: nothing is known of the time before it.
        let scan = if std::mem::take(&mut self.cold) { Scan { first: true, elapsed: 0, ..scan } } else { scan };
        let begun = self.timer.as_ref().map(|now| now());
        let result = self.instance.execute(scan, &self.ins, own as u32, &mut self.cells);
        if let Some((now, begun)) = self.timer.as_ref().zip(begun) {
            self.times[1].add(now().saturating_sub(begun));
        }
        if self.instance.has_log() {
            self.instance.drain_log(|_, _| ());
        }
        if let Err(fault) = result {
            return self.fails(&fault, "executed", Some(arguments));
        }
        self.times[0].add(took);
        self.executions += 1;
        if !self.comparer.compare(scan.now, arguments, outputs, &self.cells[own..]) {
            self.different += 1;
        }
        (self.executions >= self.wanted).then(|| match self.different {
            0 => Verdict::Same,
            n => Verdict::Different(format!(
                "{n} of {} executions gave something else: {}",
                self.executions,
                self.comparer.deviations().iter().map(|d| &*d.port).collect::<Vec<_>>().join(", ")
            )),
        })
    }

    fn configure(&mut self, cells: &[u64]) -> Option<Verdict> {
        let mut settings = self.settings_cells.clone();
        self.settings.apply(cells, &mut settings);
        for port in &self.own_settings {
            settings[*port] = self.settings_cells[*port];
        }
        let verdict = match self.instance.configure(&settings) {
            Ok(Ok(())) => None,
            Ok(Err(why)) => {
                Some(Verdict::Failed(format!("the candidate refuses settings that the running block took: {why}")))
            }
            Err(fault) => self.fails(&fault, "got new settings", None),
        };
        self.settings_cells = settings;
        verdict
    }

    fn fails(&mut self, fault: &Fault, when: &str, arguments: Option<&[u64]>) -> Option<Verdict> {
        let inputs = arguments.map(|a| named(&self.running, a)).unwrap_or_default();
        let (kind, message) = (fault.kind.name().into(), fault.message.clone());
        let why = format!("the candidate failed when it {when}: {message}");
        self.fault = Some(FailedRun { kind, message, at: self.last, inputs });
        Some(Verdict::Failed(why))
    }
}
