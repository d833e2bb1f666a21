//! The WebAssembly engine, its settings and its epoch, by which budgets are counted.

use crate::{CallPath, Component, LoadError};
use std::path::{Path, PathBuf};
use std::time::Duration;

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
pub struct Engine {}

impl Engine {
    /// Starts an engine.
    pub fn new(_options: EngineOptions) -> Result<Self, EngineError> {
        todo!()
    }

    /// Loads and checks a component. Its name is the file's, without `.wasm`.
    pub fn load_file(&self, _path: &Path) -> Result<Component, LoadError> {
        todo!()
    }

    /// Loads and checks a component from its bytes.
    pub fn load_bytes(&self, _name: &str, _bytes: &[u8]) -> Result<Component, LoadError> {
        todo!()
    }

    /// Bumps the epoch: each execution under way has one tick less left. Something must call it while blocks execute,
    /// or a block that never ends is never stopped.
    pub fn tick(&self) {
        todo!()
    }
}

/// A thread that ticks an engine; it ends when this is dropped.
pub struct Ticker {}

impl Ticker {
    /// Starts ticking once a `period`.
    pub fn start(_engine: &Engine, _period: Duration) -> Self {
        todo!()
    }
}
