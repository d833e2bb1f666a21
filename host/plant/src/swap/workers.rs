//! Threads for what takes long: at the lowest priority, so that nothing that controls waits for a compiler.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Weak};
use thread_priority::{
    NormalThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy, thread_native_id,
};

/// Most threads that compile.
const MOST: usize = 4;
/// Most times that what was called off is left to its threads: as many compilers may run beside the one that is wanted.
const LEFT: usize = 2;
/// The nicest that a thread can be, for where the idle class is refused.
const NICE: i32 = 19;

/// The threads; made when they are first wanted. The compiler spreads its work over the pool that it is called in.
#[derive(Default)]
pub(super) struct Workers {
    prepare: Option<ThreadPool>,
    save: Option<ThreadPool>,
    /// What is prepared in the pool that is.
    unfinished: Arc<()>,
    /// The same of pools that are none any more: their threads end with their work.
    left: Vec<Arc<()>>,
}

impl Workers {
    /// Has a thread prepare something.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(super) fn spawn(&mut self, work: impl FnOnce() + Send + 'static) -> Result<(), String> {
        let cpus = std::thread::available_parallelism().map_or(1, usize::from);
        let counted = Arc::clone(&self.unfinished);
        pool(&mut self.prepare, "prepare", (cpus / 2).clamp(1, MOST))?.spawn(move || {
            // It goes with the thread's end, too.
            let _counted = counted;
            work();
        });
        Ok(())
    }

    /// Something is not wanted any more. A compiler that runs cannot be stopped: it is left alone with its threads, so that
    /// what comes next does not wait for it; but only so many at once.
    pub(super) fn leave(&mut self) {
        self.left.retain(|of_pool| count(of_pool) > 0);
        if count(&self.unfinished) > 0 && self.left.len() < LEFT {
            self.left.push(std::mem::take(&mut self.unfinished));
            // It ends when all that was given to it has ended.
            self.prepare = None;
        }
    }

    /// Has a thread do something in passing: it is no swap, and holds none up.
    ///
    /// # Errors
    /// The system gives no thread.
    fn aside(&mut self, work: impl FnOnce() + Send + 'static) -> Result<(), String> {
        let cpus = std::thread::available_parallelism().map_or(1, usize::from);
        pool(&mut self.prepare, "prepare", (cpus / 2).clamp(1, MOST))?.spawn(work);
        Ok(())
    }

    /// Has a thread save something: that does not wait until something else is compiled.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(super) fn save(&mut self, work: impl FnOnce() + Send + 'static) -> Result<(), String> {
        pool(&mut self.save, "save", 1)?.spawn(work);
        Ok(())
    }

    /// What is being prepared or waits for that, wanted or not.
    pub(super) fn unfinished(&self) -> usize {
        count(&self.unfinished) + self.left.iter().map(count).sum::<usize>()
    }
}

/// Jobs that hold it.
fn count(of_pool: &Arc<()>) -> usize {
    Arc::strong_count(of_pool) - 1
}

impl super::Swaps {
    /// Has something done beside the lanes, at the lowest priority, that belongs to no swap.
    pub(crate) fn aside(&mut self, work: impl FnOnce() + Send + 'static) -> Result<(), String> {
        self.workers.aside(work)
    }
}

/// A wish stands until it is dropped.
#[derive(Default)]
pub(super) struct Wish(Arc<()>);

impl Wish {
    /// For whoever fulfils it.
    pub(super) fn watch(&self) -> Watch {
        Watch(Arc::downgrade(&self.0))
    }
}

/// Whether a wish still stands.
pub(super) struct Watch(Weak<()>);

impl Watch {
    /// It does.
    pub(super) fn stands(&self) -> bool {
        self.0.strong_count() > 0
    }
}

fn pool<'a>(pool: &'a mut Option<ThreadPool>, name: &'static str, threads: usize) -> Result<&'a ThreadPool, String> {
    let made = match pool.take() {
        Some(made) => made,
        None => make(name, threads)?,
    };
    Ok(pool.insert(made))
}

fn make(name: &'static str, threads: usize) -> Result<ThreadPool, String> {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(move |n| format!("{name}-{n}"))
        .start_handler(|_| lower())
        // Whoever waits for the result sees that there is none.
        .panic_handler(drop)
        .build()
        .map_err(|e| format!("no thread to {name} it on: {e}"))
}

/// Gives the calling thread what the processor has left.
fn lower() {
    let idle = ThreadSchedulePolicy::Normal(NormalThreadSchedulePolicy::Idle);
    // What is refused leaves an ordinary priority, which lanes are above.
    let _ = rustix::process::nice(NICE);
    let _ = set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Min, idle);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;
    use std::time::{Duration, Instant};

    const PATIENCE: Duration = Duration::from_secs(20);

    #[test]
    fn what_is_prepared_counts_until_it_ends_and_holds_up_no_save() {
        let mut workers = Workers::default();
        let (go, wait) = channel::<()>();
        let wait = Arc::new(std::sync::Mutex::new(wait));
        for _ in 0..2 * MOST {
            let wait = Arc::clone(&wait);
            workers.spawn(move || drop(wait.lock().map(|w| w.recv()))).expect("a thread");
        }
        assert_eq!(workers.unfinished(), 2 * MOST);
        let (done, saved) = channel();
        workers.save(move || done.send(()).expect("somebody waits")).expect("a thread");
        saved.recv_timeout(PATIENCE).expect("it is saved meanwhile");
        assert_eq!(workers.unfinished(), 2 * MOST);
        // All of them hear that nobody is there any more.
        drop(go);
        let begun = Instant::now();
        while workers.unfinished() > 0 && begun.elapsed() < PATIENCE {
            std::thread::yield_now();
        }
        assert_eq!(workers.unfinished(), 0);
    }

    #[test]
    fn what_was_called_off_is_not_waited_for_and_counts_until_it_ends() {
        let mut workers = Workers::default();
        let (go, wait) = channel::<()>();
        let wait = Arc::new(std::sync::Mutex::new(wait));
        // Each of them holds up the threads of its pool, as a compiler that runs for minutes does.
        for stuck in 1..=LEFT {
            for _ in 0..MOST {
                let wait = Arc::clone(&wait);
                workers.spawn(move || drop(wait.lock().map(|w| w.recv()))).expect("a thread");
            }
            workers.leave();
            assert_eq!(workers.unfinished(), stuck * MOST);
            let (done, next) = channel();
            workers.spawn(move || done.send(()).expect("somebody waits")).expect("a thread");
            next.recv_timeout(PATIENCE).expect("it does not wait for what was called off");
            let begun = Instant::now();
            while workers.unfinished() > stuck * MOST && begun.elapsed() < PATIENCE {
                std::thread::yield_now();
            }
        }
        // So many and no more.
        let stuck = Arc::clone(&wait);
        workers.spawn(move || drop(stuck.lock().map(|w| w.recv()))).expect("a thread");
        workers.leave();
        assert_eq!((workers.left.len(), workers.unfinished()), (LEFT, LEFT * MOST + 1));
        drop(go);
        let begun = Instant::now();
        while workers.unfinished() > 0 && begun.elapsed() < PATIENCE {
            std::thread::yield_now();
        }
        assert_eq!(workers.unfinished(), 0);
        workers.leave();
        assert!(workers.left.is_empty(), "what has ended is forgotten");
    }

    #[test]
    fn what_has_failed_counts_no_longer() {
        let mut workers = Workers::default();
        workers.spawn(|| panic!("it fails")).expect("a thread");
        let begun = Instant::now();
        while workers.unfinished() > 0 && begun.elapsed() < PATIENCE {
            std::thread::yield_now();
        }
        assert_eq!(workers.unfinished(), 0);
    }

    #[test]
    fn a_wish_stands_until_it_is_dropped() {
        let wish = Wish::default();
        let watch = wish.watch();
        assert!(watch.stands());
        drop(wish);
        assert!(!watch.stands());
    }
}
