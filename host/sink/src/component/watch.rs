//! The thread that ends a call which computes beyond its budget. It sleeps while there is none.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use wasmtime::Engine;

/// Watches the calls of one engine, one at a time.
pub(super) struct Watch {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    deadline: Option<Instant>,
    stop: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Two plain values: whole after any panic.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.changed.notify_one();
    }
}

impl Watch {
    /// Starts the thread.
    pub(super) fn start(engine: &Engine) -> std::io::Result<Self> {
        let shared = Arc::<Shared>::default();
        let (engine, theirs) = (engine.clone(), shared.clone());
        let watch = move || run(&engine, &theirs);
        let thread = std::thread::Builder::new().name("logger-watch".into()).spawn(watch)?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Bumps the engine's epoch once when `budget` is over, unless the guard was dropped before.
    pub(super) fn begin(&self, budget: Duration) -> Guard<'_> {
        self.shared.set(|state| state.deadline = Some(Instant::now() + budget));
        Guard(&self.shared)
    }
}

fn run(engine: &Engine, shared: &Shared) {
    let mut state = shared.lock();
    while !state.stop {
        let now = Instant::now();
        state = match state.deadline {
            None => shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
            Some(deadline) if deadline > now => {
                let left = deadline - now;
                shared.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0
            }
            Some(_) => {
                // Under the lock: a call that has ended is not mistaken for the next one.
                engine.increment_epoch();
                state.deadline = None;
                state
            }
        };
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.shared.set(|state| state.stop = true);
        if let Some(thread) = self.thread.take() {
            // It cannot panic; and if it did, there is nothing left to do.
            let _ = thread.join();
        }
    }
}

/// A call under way.
pub(super) struct Guard<'a>(&'a Shared);

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        self.0.set(|state| state.deadline = None);
    }
}
