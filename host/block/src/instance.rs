//! A block's instance: one store, one class, one call path.

use crate::component_path;
use crate::interface::{ClassInterface, Function};
use crate::plain;
use crate::state::State;
use crate::{CallPath, Class, Fault, Level, Limits};
use std::sync::Arc;
use wasmtime::Store;

/// One pass of a lane as a block sees it, `latchwork:block/types.scan`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scan {
    /// Plant time, ns.
    pub now: u64,
    /// Since this block's previous execution, ns.
    pub elapsed: u64,
    /// First execution after a cold start.
    pub first: bool,
}

/// An instance in a store of its own. After a fault every further call is a fault, too.
///
/// It is kept small: a lane walks over a thousand of them in every scan.
pub struct Instance {
    store: Store<State>,
    bound: Bound,
    ticks: u64,
    faulted: bool,
    class: Arc<ClassInterface>,
}

/// An instance's functions on one of the call paths.
pub(crate) enum Bound {
    Plain(plain::Bound),
    Component(Box<component_path::Bound>),
}

impl From<plain::Bound> for Bound {
    fn from(bound: plain::Bound) -> Self {
        Self::Plain(bound)
    }
}

impl From<component_path::Bound> for Bound {
    fn from(bound: component_path::Bound) -> Self {
        Self::Component(Box::new(bound))
    }
}

/// What a call other than `execute` gave, besides the cells of its result.
#[derive(Debug, PartialEq)]
pub(crate) enum Returned {
    /// The class does not have the function.
    Absent,
    /// It did what it should; `configure` agreed.
    Done,
    /// The sentence of `configure`.
    Refused(String),
}

impl Instance {
    pub(crate) fn new(store: Store<State>, bound: Bound, limits: &Limits, class: Arc<ClassInterface>) -> Self {
        Self { store, bound, ticks: limits.call_ticks(), faulted: false, class }
    }

    /// The class it is used as.
    pub fn class(&self) -> &Class {
        &self.class.class
    }

    /// The call path it takes.
    pub fn path(&self) -> CallPath {
        match self.bound {
            Bound::Plain(_) => CallPath::Plain,
            Bound::Component(_) => CallPath::Component,
        }
    }

    /// Executes the block once. `ins` holds the indices of the argument cells: inputs in the order of the class, each
    /// signal's quality behind its value, then the commands word. The outputs, each signal's quality behind its value,
    /// then the alarms word are written from cell `out` on. After an error no cell has changed.
    ///
    /// Argument cells must hold values of their types, as `latchwork_image::Type` makes them: a component gets others as
    /// they are, or changed to fit, and may misbehave.
    ///
    /// # Panics
    /// When `ins` does not have [`Class::argument_cells`] entries, or an index is outside `cells`.
    #[inline]
    pub fn execute(&mut self, scan: Scan, ins: &[u32], out: u32, cells: &mut [u64]) -> Result<(), Fault> {
        self.begin(Function::Execute)?;
        let result = match &mut self.bound {
            Bound::Plain(bound) => bound.execute(&mut self.store, scan, ins, out, cells),
            Bound::Component(bound) => bound.execute(&mut self.store, scan, ins, out, cells),
        };
        match result {
            Ok(()) => Ok(()),
            Err(error) => Err(self.fail(Function::Execute, &error)),
        }
    }

    /// Gives the block its settings, one cell per port; the inner error is the block's own sentence why it refuses them.
    /// A class without settings has nothing to refuse.
    ///
    /// # Panics
    /// When there is not one cell per port.
    pub fn configure(&mut self, settings: &[u64]) -> Result<Result<(), String>, Fault> {
        assert_eq!(settings.len(), self.class().settings.len(), "one cell per setting");
        Ok(match self.call(Function::Configure, settings, &mut [])? {
            Returned::Refused(sentence) => Err(sentence),
            Returned::Absent | Returned::Done => Ok(()),
        })
    }

    /// The settings the block proposes itself, one cell per port; `None` when it has no function `defaults`.
    pub fn defaults(&mut self) -> Result<Option<Vec<u64>>, Fault> {
        let mut cells = vec![0; self.class().settings.len()];
        let returned = self.call(Function::Defaults, &[], &mut cells)?;
        Ok((returned != Returned::Absent).then_some(cells))
    }

    /// The state to carry over, one cell per port of `retained`; `None` when the class retains nothing.
    pub fn save(&mut self) -> Result<Option<Vec<u64>>, Fault> {
        let mut cells = vec![0; self.class().retained.len()];
        Ok(self.save_into(&mut cells)?.then_some(cells))
    }

    /// The same into cells that are there, without an allocation on the plain path; false when the class retains nothing.
    /// After a fault the cells hold nothing of use.
    ///
    /// # Panics
    /// When there is not one cell per retained port.
    pub fn save_into(&mut self, to: &mut [u64]) -> Result<bool, Fault> {
        assert_eq!(to.len(), self.class().retained.len(), "one cell per retained port");
        self.call(Function::Save, &[], to).map(|returned| returned != Returned::Absent)
    }

    /// Hands back a state that `save` gave, without an allocation on the plain path; does nothing when the class retains
    /// nothing.
    ///
    /// # Panics
    /// When there is not one cell per port.
    pub fn restore(&mut self, state: &[u64]) -> Result<(), Fault> {
        assert_eq!(state.len(), self.class().retained.len(), "one cell per retained port");
        self.call(Function::Restore, state, &mut []).map(drop)
    }

    /// Linear memory it has now, bytes, summed over its memories. WebAssembly gives none back.
    pub fn memory(&self) -> u64 {
        self.store.data().memory_used()
    }

    /// Messages wait.
    #[inline]
    pub fn has_log(&self) -> bool {
        self.store.data().log.waiting()
    }

    /// Takes the waiting messages and returns the number of those that were dropped: of a flood the first 16 are kept,
    /// of each 256 bytes.
    pub fn drain_log(&mut self, take: impl FnMut(Level, &str)) -> u64 {
        self.store.data_mut().log.drain(take)
    }

    #[inline]
    fn begin(&mut self, function: Function) -> Result<(), Fault> {
        if self.faulted {
            return Err(Fault::dead(function, &self.class().name));
        }
        self.store.data_mut().refused = false;
        self.store.set_epoch_deadline(self.ticks);
        Ok(())
    }

    /// Calls any function but `execute`; `to` has one cell per cell of its result.
    fn call(&mut self, function: Function, args: &[u64], to: &mut [u64]) -> Result<Returned, Fault> {
        self.begin(function)?;
        let result = match &mut self.bound {
            Bound::Plain(bound) => bound.call(&mut self.store, function, args, to),
            Bound::Component(bound) => bound.call(&mut self.store, function, args, to),
        };
        result.map_err(|error| self.fail(function, &error))
    }

    #[cold]
    fn fail(&mut self, function: Function, error: &wasmtime::Error) -> Fault {
        self.faulted = true;
        Fault::new(Some(function), &self.class.class.name, error, self.store.data())
    }
}

impl std::fmt::Debug for Instance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Instance")
            .field("class", &self.class().name)
            .field("path", &self.path())
            .finish_non_exhaustive()
    }
}
