//! What a store carries: the limits it enforces, the messages it collects.

use crate::Limits;
use crate::log::LogBuffer;
use wasmtime::{Engine, Memory, ResourceLimiter, Store};

/// Core instances, memories and tables of one block; a component made of several modules has a handful.
const INSTANCES: usize = 100;

/// Data of one block's store.
pub(crate) struct State {
    /// A growth of memory or a table was refused in the present call.
    pub(crate) refused: bool,
    /// The block may call imports now; not while it allocates or cleans up for the host. Only the plain path's: in the
    /// component path wasmtime keeps count.
    pub(crate) may_leave: bool,
    /// Most bytes of one string that the block hands to the host.
    pub(crate) fuel: usize,
    /// The block's messages.
    pub(crate) log: LogBuffer,
    /// The memory that the plain path's log reads from.
    pub(crate) memory: Option<Memory>,
    memory_limit: usize,
    memory_used: usize,
    elements_limit: usize,
    elements_used: usize,
}

impl State {
    /// A store under limits, its deadline set to the time it has for instantiation.
    pub(crate) fn store(engine: &Engine, limits: &Limits, logs: bool, fuel: usize) -> Store<Self> {
        let size = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
        let state = Self {
            refused: false,
            may_leave: true,
            fuel,
            log: if logs { LogBuffer::new() } else { LogBuffer::default() },
            memory: None,
            memory_limit: size(limits.memory),
            memory_used: 0,
            elements_limit: size(limits.table_elements),
            elements_used: 0,
        };
        let mut store = Store::new(engine, state);
        store.limiter(|state| state);
        store.set_hostcall_fuel(fuel);
        store.set_epoch_deadline(limits.instantiation_ticks());
        store
    }

    /// Linear memory it has now, bytes.
    pub(crate) fn memory_used(&self) -> u64 {
        self.memory_used as u64
    }

    /// Most linear memory, bytes.
    pub(crate) fn memory_limit(&self) -> usize {
        self.memory_limit
    }
}

impl ResourceLimiter for State {
    fn memory_growing(&mut self, current: usize, desired: usize, _: Option<usize>) -> wasmtime::Result<bool> {
        let used = self.memory_used.saturating_add(desired.saturating_sub(current));
        let fits = used <= self.memory_limit;
        if fits {
            self.memory_used = used;
        } else {
            self.refused = true;
        }
        Ok(fits)
    }

    fn memory_grow_failed(&mut self, _: wasmtime::Error) -> wasmtime::Result<()> {
        self.refused = true;
        Ok(())
    }

    fn table_growing(&mut self, current: usize, desired: usize, _: Option<usize>) -> wasmtime::Result<bool> {
        let used = self.elements_used.saturating_add(desired.saturating_sub(current));
        let fits = used <= self.elements_limit;
        if fits {
            self.elements_used = used;
        } else {
            self.refused = true;
        }
        Ok(fits)
    }

    fn table_grow_failed(&mut self, _: wasmtime::Error) -> wasmtime::Result<()> {
        self.refused = true;
        Ok(())
    }

    fn instances(&self) -> usize {
        INSTANCES
    }

    fn tables(&self) -> usize {
        INSTANCES
    }

    fn memories(&self) -> usize {
        INSTANCES
    }
}
