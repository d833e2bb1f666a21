//! Threads for what takes long: at the lowest priority, so that nothing that controls waits for a compiler.

use rayon::{ThreadPool, ThreadPoolBuilder};
use thread_priority::{
    NormalThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
};

/// Most threads.
const MOST: usize = 4;
/// The nicest that a thread can be, for where the idle class is refused.
const NICE: i32 = 19;

/// The threads; made when they are first wanted. The compiler spreads its work over the pool that it is called in.
#[derive(Default)]
pub(super) struct Workers {
    pool: Option<ThreadPool>,
}

impl Workers {
    /// Has a thread do something.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(super) fn spawn(&mut self, work: impl FnOnce() + Send + 'static) -> Result<(), String> {
        let pool = match self.pool.take() {
            Some(pool) => pool,
            None => make()?,
        };
        self.pool.insert(pool).spawn(work);
        Ok(())
    }
}

fn make() -> Result<ThreadPool, String> {
    let cpus = std::thread::available_parallelism().map_or(1, usize::from);
    ThreadPoolBuilder::new()
        .num_threads((cpus / 2).clamp(1, MOST))
        .thread_name(|n| format!("prepare-{n}"))
        .start_handler(|_| lower())
        // Whoever waits for the result sees that there is none.
        .panic_handler(drop)
        .build()
        .map_err(|e| format!("no thread to prepare it on: {e}"))
}

/// Gives the calling thread what the processor has left.
fn lower() {
    let idle = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Idle);
    // What is refused leaves an ordinary priority, which lanes are above.
    let _ = rustix::process::nice(NICE);
    let _ = set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Min, idle);
}
