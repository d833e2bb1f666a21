//! A plant that runs by the machine's clock on a thread of its own, with an operator at its console.

use crate::{Log, Rig, Told};
use latchwork_plant::assemble::Time;
use latchwork_plant::operate::{Console, Operation, Operator};
use latchwork_plant::run::{MachineClock, RunOptions, run_real};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(60);

/// A plant that runs.
pub struct Running {
    console: Console,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Log>,
}

impl Running {
    /// Starts it.
    pub fn start(rig: &Rig) -> Self {
        let mut plant = rig.plant(Time::Real);
        let (console, stop) = (plant.console(), Arc::new(AtomicBool::new(false)));
        let ends = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut log = Log::default();
            run_real(plant, &RunOptions::default(), Arc::new(MachineClock::start()), &ends, &mut log);
            log
        });
        Self { console, stop, thread }
    }

    /// The operators' way to it.
    pub fn console(&self) -> &Console {
        &self.console
    }

    /// The operator anna wants something, for a reason.
    pub fn ask(&self, operation: Operation, reason: &str) -> Told {
        let operator = Operator { user: "anna".into(), origin: "cli".into(), reason: reason.into() };
        self.console.ask(operator, operation, None, PATIENCE)
    }

    /// Stops it; all that it has told.
    ///
    /// # Panics
    /// If it has panicked.
    pub fn end(self) -> Log {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().expect("no panic")
    }
}
