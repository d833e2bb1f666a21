//! The I/O threads: no lane ever waits for a device.
//!
//! Drivers wait most of their time, so one OS thread with one runtime serves many of them; a driver whose system calls may
//! block has a thread of its own, so that a bus that hangs holds up no other driver. A driver that panics ends alone: its
//! inputs turn bad because it publishes that when it is dropped, and a record says so.

use crate::driver::{Driver, DriverContext, IoEvent};
use std::any::Any;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::watch;
use tokio::task::JoinSet;

/// Time the drivers have when the owner is dropped without a call of [`IoThread::stop`].
const STOP_ON_DROP: Duration = Duration::from_secs(3);
/// Time for the runtime to end after its tasks were cancelled.
const ABORT: Duration = Duration::from_millis(200);
/// Priority of the record of a driver that is gone for good.
const GONE: u8 = 230;

type Report = Arc<Mutex<Box<dyn FnMut(IoEvent) + Send>>>;

/// The threads that run all drivers. Dropping it stops them.
pub struct IoThread {
    running: Vec<Running>,
}

type Made = (Box<dyn Driver>, DriverContext);

struct Running {
    stop: watch::Sender<bool>,
    abort: watch::Sender<bool>,
    /// Disconnected when the thread has ended.
    done: Receiver<()>,
    thread: JoinHandle<()>,
}

impl IoThread {
    /// Starts the drivers; each maker gets the stop signal for its driver's context. Without drivers no thread is
    /// started. When the machine grants no thread or no runtime, each driver reports that it does not run.
    pub fn start<M>(makers: Vec<M>) -> Self
    where
        M: FnOnce(watch::Receiver<bool>) -> Made + Send,
    {
        let (stop, stopped) = watch::channel(false);
        let made = makers.into_iter().map(|make| make(stopped.clone()));
        let (blocking, waiting): (Vec<Made>, Vec<Made>) = made.partition(|(driver, _)| driver.blocks());
        let threads = [waiting].into_iter().chain(blocking.into_iter().map(|one| vec![one]));
        let running = threads.filter(|t| !t.is_empty()).filter_map(|t| Running::start(t, stop.clone()));
        Self { running: running.collect() }
    }

    /// Tells the drivers to write their safe values and to end, and waits for that at most `limit` (and a moment more to
    /// cancel those that did not). True when every driver has ended by itself in time.
    pub fn stop(mut self, limit: Duration) -> bool {
        self.end(limit)
    }

    fn end(&mut self, limit: Duration) -> bool {
        let end = Instant::now() + limit;
        // All at once: they share the limit.
        for running in &self.running {
            running.stop.send_replace(true);
        }
        self.running.drain(..).map(|r| r.end(end)).fold(true, |all, this| all & this)
    }
}

impl Drop for IoThread {
    fn drop(&mut self) {
        self.end(STOP_ON_DROP);
    }
}

impl Running {
    /// Starts a thread for some drivers; without one they report it.
    fn start(drivers: Vec<Made>, stop: watch::Sender<bool>) -> Option<Self> {
        let (abort, aborted) = watch::channel(false);
        let (end, done) = mpsc::channel();
        // The drivers follow once the thread is there, so that they can still report when it is not.
        let (hand_over, taken) = mpsc::channel();
        let body = move || {
            let _end: mpsc::Sender<()> = end;
            if let Ok(drivers) = taken.recv() {
                run(drivers, aborted);
            }
        };
        match std::thread::Builder::new().name("io".into()).spawn(body) {
            Ok(thread) => {
                let _ = hand_over.send(drivers);
                Some(Self { stop, abort, done, thread })
            }
            Err(error) => {
                refuse(drivers, &format!("the machine granted no I/O thread: {error}"));
                None
            }
        }
    }

    /// Waits for the end of drivers that were told to stop.
    fn end(self, end: Instant) -> bool {
        let ended = |wait| self.done.recv_timeout(wait) == Err(RecvTimeoutError::Disconnected);
        if ended(end.saturating_duration_since(Instant::now())) {
            return self.thread.join().is_ok();
        }
        self.abort.send_replace(true);
        // A driver that blocks the thread itself cannot be cancelled; the process ends without it.
        if ended(ABORT) {
            let _ = self.thread.join();
        }
        false
    }
}

fn run(drivers: Vec<Made>, mut aborted: watch::Receiver<bool>) {
    let runtime = match tokio::runtime::Builder::new_current_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return refuse(drivers, &format!("the machine granted no I/O runtime: {error}")),
    };
    runtime.block_on(async {
        let mut tasks = JoinSet::new();
        for (driver, context) in drivers {
            tasks.spawn(watched(driver, context));
        }
        tokio::select! {
            () = async { while tasks.join_next().await.is_some() {} } => {}
            _ = aborted.wait_for(|a| *a) => {}
        }
    });
    // Never waits for a look-up of a name that is still under way.
    runtime.shutdown_background();
}

/// Runs one driver; whatever ends it before its time is reported.
async fn watched(driver: Box<dyn Driver>, mut context: DriverContext) {
    let stop = context.stop.clone();
    let report: Report = Arc::new(Mutex::new(context.report));
    let inner = Arc::clone(&report);
    context.report = Box::new(move |event| say(&inner, event));
    let text = match tokio::spawn(async move { driver.run(context).await }).await {
        Ok(()) if *stop.borrow() || stop.has_changed().is_err() => return,
        Ok(()) => "the driver ended by itself".to_owned(),
        Err(error) if error.is_cancelled() => return,
        Err(error) => format!("the driver panicked: {}", message(&*error.into_panic())),
    };
    let text = format!(
        "{text}; its inputs stay bad and its outputs are not written until the plant is started again. This is a defect \
         of the driver: please report it"
    );
    say(&report, IoEvent { source: String::new(), transition: "ended", priority: GONE, text });
}

fn say(report: &Report, event: IoEvent) {
    (report.lock().unwrap_or_else(PoisonError::into_inner))(event);
}

fn refuse(drivers: Vec<Made>, why: &str) {
    for (_, mut context) in drivers {
        let text = format!("the driver does not run: {why}");
        (context.report)(IoEvent { source: String::new(), transition: "ended", priority: GONE, text });
    }
}

fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}
