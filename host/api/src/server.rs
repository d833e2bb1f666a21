//! The server: one thread, from start to stop.

use crate::ApiError;
use crate::connections::accept;
use crate::gate::Gate;
use crate::routes::router;
use crate::socket::Socket;
use crate::upload::Uploads;
use latchwork_plant::operate::{Console, Policy};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::{Semaphore, oneshot};

/// Threads that wait for the plant or read the journal at once. What finds none free waits its turn.
const BLOCKING: usize = 16;
/// Those of them that read the journal at once: whoever looks through all of it does not keep others from the plant.
const READING: usize = 2;
/// Niceness of all that is done here: lanes without real-time priority, and the plant's own thread, come first.
const NICENESS: i32 = 5;

/// What a server needs to know.
#[derive(Clone, Debug)]
pub struct Config {
    /// Path of the socket; its folder is made if it is not there.
    pub socket: PathBuf,
    /// Name of the plant.
    pub plant: String,
    /// Who may do what.
    pub policy: Policy,
    /// Folder of the journal, if the plant keeps one.
    pub data: Option<PathBuf>,
    /// What a client may take.
    pub limits: Limits,
}

/// What a client may take, so that one that hangs or floods harms nobody.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Connections at once.
    pub connections: usize,
    /// Connections of one user; the plant's own user and root may use all of them, and as many more.
    pub per_user: usize,
    /// Bytes of a request's body.
    pub body: usize,
    /// Bytes that the components of one swap have together.
    pub components: usize,
    /// A connection that says nothing for so long is closed; the head of a request must be there in that time, too.
    pub idle: Duration,
    /// A client that takes nothing of an answer for so long is left.
    pub unread: Duration,
    /// The plant has so long to answer.
    pub plant: Duration,
    /// An answer that something is forbidden waits so long: each is a record, and nobody shall fill the journal with them.
    pub forbidden: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            connections: 64,
            per_user: 16,
            body: 64 << 10,
            components: 64 << 20,
            idle: Duration::from_secs(30),
            unread: Duration::from_secs(10),
            plant: Duration::from_secs(5),
            forbidden: Duration::from_millis(250),
        }
    }
}

/// What all requests share.
pub(crate) struct Shared {
    pub(crate) console: Console,
    pub(crate) gate: Gate,
    pub(crate) plant: String,
    pub(crate) data: Option<PathBuf>,
    pub(crate) limits: Limits,
    /// Who is sending components.
    pub(crate) uploads: Uploads,
    /// Turns to read the journal.
    pub(crate) reading: Arc<Semaphore>,
}

/// A control socket that is served. Dropped, it ends: connections are cut and the socket's file goes away.
pub struct Server {
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
    warnings: Vec<String>,
}

impl Server {
    /// Opens the socket and serves it from a thread of its own.
    ///
    /// # Errors
    /// A socket that another plant serves, a path that cannot be one, no thread.
    pub fn start(config: Config, console: Console) -> Result<Self, ApiError> {
        let gate = Gate::new(config.policy);
        let warnings = gate.unknown();
        let (socket, listener) = Socket::open(&config.socket, gate.names_others())?;
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .max_blocking_threads(BLOCKING)
            .thread_name("api-waits")
            .on_thread_start(step_back)
            .build()
            .map_err(ApiError::Start)?;
        let listener = {
            let _inside = runtime.enter();
            tokio::net::UnixListener::from_std(listener).map_err(ApiError::Start)?
        };
        let Config { plant, data, limits, .. } = config;
        let reading = Arc::new(Semaphore::new(READING));
        let uploads = Uploads::default();
        let shared = Arc::new(Shared { console, gate, plant, data, limits, uploads, reading });
        let (stop, stopped) = oneshot::channel();
        let body = move || {
            step_back();
            let router = router(Arc::clone(&shared));
            runtime.block_on(async {
                tokio::select! {
                    () = accept(listener, shared, router) => {}
                    _ = stopped => {}
                }
            });
            drop(socket);
            // What still waits for the plant or the disk is not waited for.
            runtime.shutdown_background();
        };
        let thread = std::thread::Builder::new().name("api".into()).spawn(body).map_err(ApiError::Start)?;
        Ok(Self { stop: Some(stop), thread: Some(thread), warnings })
    }

    /// What the policy names and this machine does not know.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }
}

/// The calling thread lets others go first.
fn step_back() {
    // Refused, it works as well.
    let _ = rustix::process::setpriority_process(None, NICENESS);
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            // The thread may have ended.
            let _ = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
