//! A recorded component alone, given what was recorded.

use super::player::Version;
use latchwork_block::{Class, Fault, Instance, Scan};
use std::sync::Arc;

/// An instance with its cells.
pub(super) struct Grounds {
    version: Version,
    instance: Option<Instance>,
    cells: Vec<u64>,
    ins: Vec<u32>,
}

impl Grounds {
    pub(super) fn new(version: &Version) -> Self {
        let class = version.class();
        let arguments = class.argument_cells();
        Self {
            instance: None,
            cells: vec![0; arguments + class.output_cells()],
            ins: (0..arguments as u32).collect(),
            version: version.clone(),
        }
    }

    pub(super) fn class(&self) -> Arc<Class> {
        self.version.class()
    }

    /// A fresh instance with settings, and with a state unless that is empty; none when it does not take them.
    pub(super) fn start(&mut self, settings: &[u64], state: &[u64]) {
        let made = self.version.instantiate().and_then(|mut instance| {
            let taken = instance.configure(settings)?.is_ok();
            if !state.is_empty() {
                instance.restore(state)?;
            }
            Ok(taken.then_some(instance))
        });
        self.instance = made.ok().flatten();
    }

    /// What it says to settings; `None` when it is out of order, or is from now on.
    pub(super) fn configure(&mut self, settings: &[u64]) -> Option<Result<(), String>> {
        let answer = self.instance.as_mut()?.configure(settings).ok();
        if answer.is_none() {
            self.instance = None;
        }
        answer
    }

    /// Its outputs, or its fault; `None` when it is out of order.
    pub(super) fn execute(&mut self, scan: Scan, arguments: &[u64]) -> Option<Result<&[u64], Fault>> {
        let own = self.ins.len();
        self.cells[..own].copy_from_slice(arguments);
        let instance = self.instance.as_mut()?;
        let result = instance.execute(scan, &self.ins, own as u32, &mut self.cells);
        instance.drain_log(|_, _| ());
        if result.is_err() {
            self.instance = None;
        }
        Some(result.map(|()| &self.cells[own..]))
    }
}
