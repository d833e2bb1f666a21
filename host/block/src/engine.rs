//! The WebAssembly engine, its settings and its epoch, by which budgets are counted.

use crate::cache::Cache;
use crate::component::Loaded;
use crate::{CallPath, Component, LoadError};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::thread::JoinHandle;
use std::time::Duration;
use wasmtime::Config;

/// Stack a block may use, bytes. Threads that execute blocks need more than this.
const STACK: usize = 512 << 10;

/// How to start an engine.
#[derive(Clone, Debug, Default)]
pub struct EngineOptions {
    /// Folder for compiled code; made if it is not there. `None` compiles everything anew.
    pub cache: Option<PathBuf>,
    /// Takes this call path for every component instead of the best one; for tests and comparisons. A component that
    /// the plain path cannot take is refused under `Some(CallPath::Plain)`.
    pub force_path: Option<CallPath>,
}

/// The engine could not be started.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct EngineError(pub(crate) String);

/// Loads components. Cheap to clone; all clones share one epoch.
#[derive(Clone)]
pub struct Engine {
    shared: Arc<Shared>,
}

struct Shared {
    wasmtime: wasmtime::Engine,
    options: EngineOptions,
    cache: Option<Cache>,
    /// Components in use, by name and hash: a plant of a thousand equal blocks validates and compiles one.
    loaded: Mutex<HashMap<(String, String), Weak<Loaded>>>,
}

/// Settings of the engine. Each was measured: these give the cheapest call and the least memory per block.
fn config() -> Config {
    let mut config = Config::new();
    config
        .concurrency_support(false)
        .epoch_interruption(true)
        // Address space of 4 GiB per block runs out on small machines and makes each call colder.
        .memory_reservation(0)
        .memory_reservation_for_growth(0)
        .memory_guard_size(65536)
        .memory_init_cow(true)
        .max_wasm_stack(STACK)
        .wasm_backtrace_max_frames(None);
    config
}

impl Engine {
    /// Starts an engine.
    pub fn new(options: EngineOptions) -> Result<Self, EngineError> {
        let wasmtime = wasmtime::Engine::new(&config()).map_err(|e| EngineError(format!("{e:#}")))?;
        let cache = options.cache.clone().map(|folder| Cache::new(folder, &wasmtime));
        Ok(Self { shared: Arc::new(Shared { wasmtime, options, cache, loaded: Mutex::default() }) })
    }

    /// Loads and checks a component. Its name is the file's, without `.wasm`.
    pub fn load_file(&self, path: &Path) -> Result<Component, LoadError> {
        // Reading a pipe would wait for ever.
        let kind = std::fs::metadata(path)?.file_type();
        if !kind.is_file() && !kind.is_dir() {
            return Err(std::io::Error::other("it is a pipe or a device").into());
        }
        let bytes = std::fs::read(path)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        self.load_bytes(&name, &bytes)
    }

    /// Loads and checks a component from its bytes.
    pub fn load_bytes(&self, name: &str, bytes: &[u8]) -> Result<Component, LoadError> {
        let key = (name.to_string(), Component::hash_of(bytes));
        let known = self.loaded().get(&key).and_then(Weak::upgrade);
        if let Some(loaded) = known {
            return Ok(Component::from_loaded(loaded));
        }
        let component = Component::load(self, name, key.1.clone(), bytes)?;
        let mut loaded = self.loaded();
        loaded.retain(|_, c| c.strong_count() > 0);
        loaded.insert(key, component.downgrade());
        Ok(component)
    }

    /// Bumps the epoch: each execution under way has one tick less left. Something must call it while blocks execute,
    /// or a block that never ends is never stopped.
    pub fn tick(&self) {
        self.shared.wasmtime.increment_epoch();
    }

    pub(crate) fn wasmtime(&self) -> &wasmtime::Engine {
        &self.shared.wasmtime
    }

    pub(crate) fn options(&self) -> &EngineOptions {
        &self.shared.options
    }

    /// Folder of compiled components, if they are kept.
    pub fn cache_folder(&self) -> Option<&Path> {
        self.shared.options.cache.as_deref()
    }

    pub(crate) fn cache(&self) -> Option<&Cache> {
        self.shared.cache.as_ref()
    }

    fn loaded(&self) -> std::sync::MutexGuard<'_, HashMap<(String, String), Weak<Loaded>>> {
        // The map is whole between any two statements that could panic.
        self.shared.loaded.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for Engine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Engine").field("options", self.options()).finish_non_exhaustive()
    }
}

/// A thread that ticks an engine; it ends when this is dropped.
#[derive(Debug)]
pub struct Ticker {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Ticker {
    /// Starts ticking once a `period`.
    ///
    /// # Panics
    /// When the system gives no thread: without it no budget is kept.
    pub fn start(engine: &Engine, period: Duration) -> Self {
        let engine = engine.clone();
        let (stop, stopped) = channel::<()>();
        let tick = move || {
            while stopped.recv_timeout(period) == Err(RecvTimeoutError::Timeout) {
                engine.tick();
            }
        };
        let thread = std::thread::Builder::new().name("epoch".into()).spawn(tick).expect("a thread for the epoch");
        Self { stop: Some(stop), thread: Some(thread) }
    }
}

impl Drop for Ticker {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // It cannot panic; and if it did, there is nothing left to do.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ticker_stops_at_once_however_long_its_period() {
        let engine = Engine::new(EngineOptions::default()).expect("an engine");
        let begun = std::time::Instant::now();
        drop(Ticker::start(&engine, Duration::from_secs(3600)));
        assert!(begun.elapsed() < Duration::from_secs(60));
    }
}
