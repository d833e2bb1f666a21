//! All sinks of a plant, each on a thread of its own: one that hangs or panics harms no other.

use crate::component;
use crate::exchange::{Call, Exchanges, Seat, Swapper};
use crate::feed::Feed;
use crate::keys::Settings;
use crate::worker::{LAST, Tell, Worker};
use crate::{Config, SinkKind, State, Status, Statuses};
use latchwork_record::journal::Watch;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

/// How much longer than its last deliveries a sink may take to end before it is left behind.
const GRACE: Duration = Duration::from_secs(1);

/// What a sink has to tell. It tells of a change, never twice of the same state.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Which sink, counted from 0 in the order of the plant file.
    pub sink: usize,
    /// Its name.
    pub name: String,
    /// What.
    pub what: What,
}

/// What has become of a sink.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum What {
    /// It takes no records: why.
    Refused(String),
    /// It takes them again.
    Accepted {
        /// Numbers that wait for it.
        waiting: u64,
    },
    /// It has panicked, and gets nothing until the next run.
    Ended(String),
}

/// The sinks at work.
pub struct Runner {
    stop: Arc<AtomicBool>,
    watch: Watch,
    statuses: Statuses,
    /// Names of the sinks; their threads hold the other end of the channel.
    names: Vec<String>,
    seats: Arc<[Seat]>,
    done: Receiver<usize>,
}

impl Runner {
    /// Starts a thread for each sink. `folder` is the journal's, `cursors` are what its opening gave; `tell` is called from the
    /// sinks' threads and must not wait.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn start(
        folder: &Path,
        sinks: impl IntoIterator<Item = (&'static SinkKind, Config)>,
        cursors: &BTreeMap<String, u64>,
        watch: &Watch,
        tell: impl Fn(Report) + Send + Sync + 'static,
    ) -> std::io::Result<Self> {
        let (finished, done) = channel();
        let (stop, statuses, tell) = (Arc::new(AtomicBool::new(false)), Statuses::new(watch), Arc::new(tell) as Tell);
        let seats = Arc::new([]);
        let mut runner = Self { stop, watch: watch.clone(), statuses, names: Vec::new(), seats, done };
        let mut seats = Vec::new();
        for (kind, mut config) in sinks {
            config.journal = watch.journal().to_owned();
            let settings = Settings::new(&config);
            let cursor = cursors.get(&config.name).copied().unwrap_or_else(|| {
                let begin = if settings.now { watch.durable() } else { 0 };
                watch.moved(&config.name, begin);
                begin
            });
            let version = std::ptr::eq(kind, &component::COMPONENT).then(|| component::version(&config)).flatten();
            let (name, of_kind) = (config.name.clone(), kind.name.to_owned());
            let status = Status { name, kind: of_kind, cursor, version, ..Status::default() };
            let call = Arc::<Call>::default();
            seats.push(Seat { kind, config: config.clone(), call: Arc::clone(&call) });
            let worker = Worker {
                kind,
                feed: Feed::new(folder.to_owned(), settings, cursor),
                watch: watch.clone(),
                stop: Arc::clone(&runner.stop),
                tell: Arc::clone(&tell),
                index: runner.statuses.add(status),
                statuses: runner.statuses.clone(),
                sink: None,
                call,
                exchanges: Exchanges::default(),
                pause: None,
                config,
            };
            runner.names.push(worker.config.name.clone());
            spawn(worker, finished.clone())?;
        }
        runner.seats = seats.into();
        Ok(runner)
    }

    /// How the sinks are.
    pub fn statuses(&self) -> Statuses {
        self.statuses.clone()
    }

    /// The handle that exchanges them.
    pub fn swapper(&self) -> Swapper {
        Swapper { seats: Arc::clone(&self.seats), watch: self.watch.clone(), statuses: self.statuses.clone() }
    }

    /// Lets each sink have what is durable, for a bounded time, and ends them; the names of those that did not end in time.
    /// Their threads go with the process.
    pub fn stop(self) -> Vec<String> {
        self.stop.store(true, Ordering::Release);
        self.seats.iter().for_each(|seat| seat.call.ring(&self.watch));
        let end = Instant::now() + LAST + GRACE;
        let mut left: Vec<Option<String>> = self.names.iter().cloned().map(Some).collect();
        while left.iter().any(Option::is_some) {
            match self.done.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(index) => left[index] = None,
                Err(_) => break,
            }
        }
        left.into_iter().flatten().collect()
    }
}

fn spawn(mut worker: Worker, finished: Sender<usize>) -> std::io::Result<()> {
    let name = format!("sink {}", worker.config.name);
    let body = move || {
        // Nothing of the sink is used after its panic.
        if let Err(panic) = catch_unwind(AssertUnwindSafe(|| worker.run())) {
            let why = panic.downcast_ref::<&str>().map(|s| (*s).to_owned());
            let why = why.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "a panic".into());
            worker.statuses.change(worker.index, |s| (s.state, s.error) = (State::Ended, why.clone()));
            worker.call.give_up(&why);
            (worker.tell)(Report { sink: worker.index, name: worker.config.name.clone(), what: What::Ended(why) });
            // Its destructor may panic as well, and those of the versions before.
            let all = (worker.sink.take(), std::mem::take(&mut worker.exchanges));
            let _ = catch_unwind(AssertUnwindSafe(|| drop(all)));
        }
        // Nobody waits any more when it took too long.
        let _ = finished.send(worker.index);
    };
    std::thread::Builder::new().name(name).spawn(body).map(drop)
}
