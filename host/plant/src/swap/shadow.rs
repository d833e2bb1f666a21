//! The shadow: a candidate gets the very inputs, commands and time of the running block; what it gives is compared and thrown
//! away.
//!
//! ```text
//! lane ─tap─► Run { state ─► candidate.restore │ execution ─► candidate.execute ─► compare │ settings ─► candidate.configure }
//! ```
//!
//! By the machine's clock it runs on a thread of its own at low priority, at virtual time in [`Shadow::poll`].

mod run;

use super::{ShadowReport, Tolerance};
use crate::lane::{Request, TapSlot, Timer, tap};
use crate::run::{Clock, MachineClock};
use latchwork_block::{Class, Instance};
use latchwork_testbed::replay::{ToleranceError, Tolerances};
use run::Run;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Executions that may be on their way to the shadow: some time of a fast lane, for a thread that gets its turn late.
const ROOM: usize = 2048;
/// Most words of the same: 4 MiB.
const WORDS: usize = 1 << 19;
/// How often the thread looks for executions.
const LOOK: Duration = Duration::from_millis(1);
/// Its niceness.
const NICE: i32 = 10;

/// What is to run in the shadow of a block, and how it is judged.
pub struct Candidate<'a> {
    /// Name of the block.
    pub block: String,
    /// Place of the block in its lane.
    pub index: u32,
    /// Class of the running block.
    pub running: Arc<Class>,
    /// The candidate, configured. It is used up: for the exchange make another one.
    pub instance: Instance,
    /// Settings it was configured with.
    pub settings: Vec<u64>,
    /// Those of them, by port, that the order sets itself: they do not follow the running block's.
    pub own_settings: Vec<usize>,
    /// Retained values that do not fit are clamped.
    pub lossy: bool,
    /// Executions to compare, from 1.
    pub executions: u64,
    /// Deviations that do not count.
    pub tolerances: &'a [Tolerance],
    /// By the machine's clock, on a thread of its own; otherwise within [`Shadow::poll`].
    pub real_time: bool,
}

/// What came out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Everything was the same, within the tolerances.
    Same,
    /// Something was different; the report says what.
    Different(String),
    /// The candidate failed, or was not comparable: why.
    Failed(String),
}

impl Verdict {
    /// Why the swap must not be; `None` when it may.
    pub fn objection(&self) -> Option<&str> {
        match self {
            Self::Same => None,
            Self::Different(why) | Self::Failed(why) => Some(why),
        }
    }
}

/// A shadow under way.
pub struct Shadow {
    block: u32,
    known: Arc<Known>,
    /// At virtual time.
    run: Option<Run>,
}

/// What the thread tells.
struct Known {
    progress: Mutex<Progress>,
    stop: AtomicBool,
}

#[derive(Clone, Default)]
struct Progress {
    report: ShadowReport,
    verdict: Option<Verdict>,
    left: u64,
}

impl Known {
    fn progress(&self) -> std::sync::MutexGuard<'_, Progress> {
        // It is replaced as a whole.
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Shadow {
    /// Starts it: the request is to be sent to the block's lane. No settings may be on their way to the block at that moment.
    pub fn start(candidate: Candidate<'_>) -> Result<(Self, Request), ToleranceError> {
        let tolerances = Tolerances::new(candidate.tolerances.iter().map(|t| (&*t.tag, t.within)))?;
        let class = &candidate.running;
        let room = WORDS / (class.argument_cells() + class.output_cells() + 4);
        let timer = candidate.real_time.then(timer);
        let (lane_end, reader) = tap(class, ROOM.min(room), timer.clone());
        let request = Request::Tap { block: candidate.index, slot: TapSlot::Shadow, tap: lane_end };
        let (block, real_time) = (candidate.index, candidate.real_time);
        let run = Run::new(candidate, &tolerances, reader, timer);
        let known = Known { progress: Mutex::new(run.progress(None)), stop: AtomicBool::new(false) };
        let mut shadow = Self { block, known: Arc::new(known), run: Some(run) };
        if real_time && let Some(run) = shadow.run.take() {
            let known = Arc::clone(&shadow.known);
            let thread = std::thread::Builder::new().name("shadow".into()).spawn(move || work(run, &known));
            if let Err(error) = thread {
                let verdict = Verdict::Failed(format!("the shadow got no thread: {error}"));
                shadow.known.progress().verdict = Some(verdict);
            }
        }
        Ok((shadow, request))
    }

    /// Goes on; `Some` from the moment on that it has ended.
    pub fn poll(&mut self) -> Option<Verdict> {
        if let Some(run) = &mut self.run {
            let verdict = self.known.progress().verdict.take().or_else(|| run.take());
            *self.known.progress() = run.progress(verdict);
        }
        self.known.progress().verdict.clone()
    }

    /// What it has seen so far.
    pub fn report(&self) -> ShadowReport {
        self.known.progress().report.clone()
    }

    /// Executions it has still before it.
    pub fn left(&self) -> u64 {
        self.known.progress().left
    }

    /// Place of its block in the lane.
    pub(super) fn block(&self) -> u32 {
        self.block
    }

    /// The request that ends its tap; to be sent whatever the verdict was.
    pub fn stop(&self) -> Request {
        self.known.stop.store(true, Ordering::Relaxed);
        Request::Untap { block: self.block, slot: TapSlot::Shadow }
    }
}

impl Drop for Shadow {
    /// The thread ends by itself: to wait here for a candidate that loops would hold up whoever looks after the plant.
    fn drop(&mut self) {
        self.known.stop.store(true, Ordering::Relaxed);
    }
}

fn timer() -> Timer {
    let clock = MachineClock::start();
    Arc::new(move || clock.now())
}

/// The thread.
fn work(mut run: Run, known: &Known) {
    // Without the right to be nice it competes with other ordinary threads, not with lanes.
    let _ = rustix::process::setpriority_process(None, NICE);
    let mut told = 0;
    loop {
        let verdict = run.take();
        let ended = verdict.is_some() || known.stop.load(Ordering::Relaxed);
        if ended || run.count() != told {
            told = run.count();
            let progress = run.progress(verdict);
            *known.progress() = progress;
        }
        if ended {
            return;
        }
        std::thread::sleep(LOOK);
    }
}
