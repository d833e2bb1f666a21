//! The versions that a block has had, and how to make each again.

use super::Version;
use crate::supervisor::Recipe;
use latchwork_block::{Component, Instance};
use std::collections::VecDeque;

/// Versions that are kept of one block.
const DEPTH: usize = 8;
/// Newest ones of them whose instances are kept; of older ones the state is.
const INSTANCES: usize = 2;

/// A component in use.
#[derive(Clone)]
pub(super) struct Release {
    /// The component.
    pub(super) component: Component,
    /// Since when, ns since 1970.
    pub(super) since: u64,
    /// By whom; empty: it is the plant file's.
    pub(super) by: String,
}

/// A version that does not execute any more.
pub(super) struct Earlier {
    pub(super) release: Release,
    pub(super) recipe: Recipe,
    /// The state it had when it was replaced; none when it retains nothing or could not save.
    pub(super) state: Option<Box<[u64]>>,
    /// The instance as it stood then.
    pub(super) instance: Option<Instance>,
}

/// All versions of one block.
pub(super) struct History {
    /// What executes.
    pub(super) current: Release,
    /// What executed before, the newest last.
    pub(super) earlier: VecDeque<Earlier>,
}

impl History {
    pub(super) fn new(current: Release) -> Self {
        Self { current, earlier: VecDeque::new() }
    }

    /// One more has been replaced.
    pub(super) fn push(&mut self, earlier: Earlier) {
        self.earlier.push_back(earlier);
        if self.earlier.len() > DEPTH {
            self.earlier.pop_front();
        }
        let old = self.earlier.len().saturating_sub(INSTANCES);
        self.earlier.iter_mut().take(old).for_each(|e| e.instance = None);
    }

    /// The earlier one with this number.
    pub(super) fn find(&mut self, version: u64) -> Option<&mut Earlier> {
        self.earlier.iter_mut().find(|e| e.recipe.version == version)
    }

    /// Takes the earlier one with this number out.
    pub(super) fn take(&mut self, version: u64) -> Option<Earlier> {
        let at = self.earlier.iter().position(|e| e.recipe.version == version)?;
        self.earlier.remove(at)
    }
}

impl Version {
    /// A component as a block runs it.
    pub(super) fn new(component: &Component, recipe: &Recipe) -> Self {
        Self {
            component: component.name().into(),
            hash: component.hash().into(),
            size: component.size(),
            class: recipe.template.class().name.clone(),
            imports: component.imports().to_vec(),
            path: format!("{:?}", recipe.template.path()).to_lowercase(),
        }
    }

    /// `motor 3f9a0c11d2e4`: name and as much of the hash as tells versions apart.
    pub(super) fn short(&self) -> String {
        format!("{} {}", self.component, self.hash.get(..12).unwrap_or(&self.hash))
    }
}
