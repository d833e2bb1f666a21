//! Runs instances of one logger: compiles it, makes an instance, calls it within its budget, and says what went wrong.

use super::bindings::{Entry, Logger, LoggerPre};
use super::grants::Grants;
use super::watch::Watch;
use super::world::{RESOURCES, World, linker};
use latchwork_image::format_duration;
use latchwork_schema::format_size;
use std::time::Duration;
use tokio::runtime::{Builder, Runtime};
use wasmtime::component::ResourceTableError;
use wasmtime::{Config, Engine, Store, Trap};
use wasmtime_wasi::I32Exit;

/// Stack of a logger: languages with an interpreter recurse deeply.
const STACK: usize = 1 << 20;
/// Most bytes that one call into the host may carry.
const HOST_CALL: usize = 16 << 20;
/// Threads for files that do not answer. More calls wait for these, each for its budget at most.
const FILE_THREADS: usize = 4;
/// An instance may take so many budgets to come up.
const START: u32 = 10;
/// Most bytes of a sentence.
const SENTENCE: usize = 1000;

/// Makes and calls instances.
pub(super) struct Host {
    grants: Grants,
    engine: Engine,
    /// Started by the first call: its thread takes its priority from there, not from where this was compiled.
    watch: Option<Watch>,
    /// Compiled at the first write: that may take seconds, and a plant does not wait for its loggers.
    code: Option<LoggerPre<World>>,
    runtime: Option<Runtime>,
}

/// An instance that was opened.
pub(super) struct Running {
    store: Store<World>,
    logger: Logger,
}

impl Host {
    /// For a component. Nothing is compiled yet.
    pub(super) fn new(grants: Grants) -> Result<Self, String> {
        let mut config = Config::new();
        config
            .concurrency_support(false)
            .epoch_interruption(true)
            // Reservations of 4 GiB run out on small machines.
            .memory_reservation(0)
            .memory_reservation_for_growth(1 << 20)
            .memory_guard_size(65536)
            .memory_init_cow(true)
            .max_wasm_stack(STACK)
            .async_stack_size(2 * STACK)
            .wasm_backtrace_max_frames(None);
        let engine = Engine::new(&config).map_err(|e| format!("the engine does not start: {e:#}"))?;
        let mut runtime = Builder::new_current_thread();
        let runtime = runtime.enable_all().max_blocking_threads(FILE_THREADS).build();
        let runtime = runtime.map_err(|e| format!("the system gives no thread for files: {e}"))?;
        Ok(Self { grants, engine, watch: None, code: None, runtime: Some(runtime) })
    }

    /// Does now what the first start would begin with.
    pub(super) fn compile(&mut self) -> Result<(), String> {
        self.code().map(drop)
    }

    /// A new instance, opened.
    pub(super) fn start(&mut self) -> Result<Running, String> {
        let code = self.code()?;
        if self.watch.is_none() {
            let watch = Watch::start(&self.engine).map_err(|e| format!("the system gives no thread: {e}"))?;
            self.watch = Some(watch);
        }
        let mut store = Store::new(&self.engine, World::new(&self.grants)?);
        store.limiter(|world| &mut world.limiter);
        store.set_hostcall_fuel(HOST_CALL);
        let made =
            self.within(&mut store, self.grants.budget * START, async |store| code.instantiate_async(store).await);
        let logger = made.map_err(|e| format!("the logger does not start: {e}"))?;
        let mut running = Running { store, logger };
        let config = &self.grants.config;
        let opened = self.within(&mut running.store, self.grants.budget, async |store| {
            running.logger.latchwork_journal_sink().call_open(store, config).await
        });
        match opened {
            Ok(Ok(())) => Ok(running),
            Ok(Err(sentence)) => Err(cut(format!("the logger does not open: {sentence}"))),
            Err(fault) => Err(format!("the logger failed in `open`: {fault}")),
        }
    }

    /// Hands a batch over; the highest number that is kept.
    pub(super) fn write(&self, running: &mut Running, batch: &[Entry<'_>]) -> Result<u64, String> {
        let logger = &running.logger;
        let written = self.within(&mut running.store, self.grants.budget, async |store| {
            logger.latchwork_journal_sink().call_write(store, batch).await
        });
        match written {
            Ok(Ok(kept)) => Ok(kept),
            Ok(Err(sentence)) => Err(cut(sentence)),
            Err(fault) => Err(format!("the logger failed in `write`: {fault}")),
        }
    }

    fn code(&mut self) -> Result<LoggerPre<World>, String> {
        if let Some(code) = &self.code {
            return Ok(code.clone());
        }
        let bytes = &self.grants.bytes;
        let code = latchwork_block::compile(&self.engine, self.grants.cache.as_deref(), bytes)
            .and_then(|component| LoggerPre::new(linker(&self.engine)?.instantiate_pre(&component)?));
        let code = code.map_err(|e| {
            let path = self.grants.component.display();
            cut(format!("{path} cannot be used: {e:#}; build it for the world latchwork:journal/logger"))
        })?;
        // Compiled code stands for it now.
        self.grants.bytes = Vec::new();
        Ok(self.code.insert(code).clone())
    }

    /// Runs a call to its end or to the end of its time: the watch stops what computes, the timer what waits for a file or
    /// a peer.
    fn within<T>(
        &self,
        store: &mut Store<World>,
        budget: Duration,
        call: impl AsyncFnOnce(&mut Store<World>) -> wasmtime::Result<T>,
    ) -> Result<T, String> {
        let (Some(runtime), Some(watch)) = (&self.runtime, &self.watch) else {
            return Err("the logger has ended".into());
        };
        store.set_epoch_deadline(1);
        let watching = watch.begin(budget);
        let done = runtime.block_on(async { tokio::time::timeout(budget, call(&mut *store)).await });
        drop(watching);
        match done {
            Ok(Ok(result)) => Ok(result),
            Ok(Err(error)) => Err(self.fault(store, budget, &error)),
            Err(_) => Err(with_said(store, late(budget, "waited"))),
        }
    }

    fn fault(&self, store: &Store<World>, budget: Duration, error: &wasmtime::Error) -> String {
        let exceeded = store.data().limiter.exceeded();
        let trap = error.downcast_ref::<Trap>();
        let sentence = if trap == Some(&Trap::Interrupt) {
            late(budget, "computed")
        } else if let Some(memory) = exceeded {
            let memory = format_size(memory);
            format!("it wanted more than the {memory} that `memory` grants ({error:#})")
        } else if let Some(I32Exit(status)) = error.downcast_ref::<I32Exit>() {
            format!("it ended itself with status {status}")
        } else if let Some(ResourceTableError::Full) = error.downcast_ref() {
            format!("it wanted more than {RESOURCES} files, connections and streams at once")
        } else if let Some(trap) = trap {
            let trap = trap.to_string();
            format!("it trapped: {}", trap.strip_prefix("wasm trap: ").unwrap_or(&trap))
        } else {
            format!("{error:#}")
        };
        with_said(store, sentence)
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            // A file that does not answer is not waited for.
            runtime.shutdown_background();
        }
    }
}

fn late(budget: Duration, what: &str) -> String {
    let budget = format_duration(u64::try_from(budget.as_nanos()).unwrap_or(u64::MAX));
    format!("it {what} longer than {budget}; grant it more with `budget` if it needs that")
}

fn with_said(store: &Store<World>, sentence: String) -> String {
    cut(match store.data().said.take() {
        Some(said) => format!("{sentence}; it said: {said}"),
        None => sentence,
    })
}

/// A sentence of bearable length, without what would break a line of a display.
fn cut(mut sentence: String) -> String {
    sentence.truncate(sentence.floor_char_boundary(SENTENCE));
    sentence.replace(|c: char| c.is_control(), " ")
}
