//! A component that was loaded and checked, and a class of it that was compiled.

use crate::{Class, Fault, Instance, Limits, LoadError};
use std::sync::Arc;

/// How a block is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallPath {
    /// Through wasmtime's component API; any component.
    Component,
    /// Straight into the one core module that the component consists of.
    Plain,
}

/// A component that was read and checked. Cheap to clone.
#[derive(Clone)]
pub struct Component {}

impl Component {
    /// Name it was loaded by.
    pub fn name(&self) -> &str {
        todo!()
    }

    /// SHA-256 of the bytes, hex.
    pub fn hash(&self) -> &str {
        todo!()
    }

    /// Size in bytes.
    pub fn size(&self) -> u64 {
        todo!()
    }

    /// What it imports, besides interfaces that hold types only.
    pub fn imports(&self) -> &[String] {
        todo!()
    }

    /// The device classes it exports, at least one.
    pub fn classes(&self) -> impl Iterator<Item = &Class> {
        [].into_iter()
    }

    /// One class by its name, with or without version; `None` means the only one.
    pub fn class(&self, _name: Option<&str>) -> Result<Arc<Class>, LoadError> {
        todo!()
    }

    /// Compiles a class of this component, or takes it from the cache.
    pub fn template(&self, _class: &Class) -> Result<Template, LoadError> {
        todo!()
    }
}

/// A class of a component, compiled. Cheap to clone.
#[derive(Clone)]
pub struct Template {}

impl Template {
    /// The call path its instances take.
    pub fn path(&self) -> CallPath {
        todo!()
    }

    /// Why they do not take the plain path.
    pub fn why_not_plain(&self) -> Option<&str> {
        todo!()
    }

    /// The class.
    pub fn class(&self) -> &Arc<Class> {
        todo!()
    }

    /// Makes an instance in a store of its own. It is not configured.
    pub fn instantiate(&self, _limits: &Limits) -> Result<Instance, Fault> {
        todo!()
    }
}
