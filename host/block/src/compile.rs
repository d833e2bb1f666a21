//! From bytes to compiled code: by the cache if there is one, or by the compiler.

use crate::cache::{Cache, Kind};
use std::path::Path;
use wasmtime::component::Component;
use wasmtime::{Engine, Module, Result};

/// Compiles a component for an engine of somebody else's, such as the one of loggers. `folder` is that of the cache of compiled
/// code, shared with all other engines; `None` compiles anew.
///
/// # Errors
/// What the engine cannot compile.
pub fn compile(engine: &Engine, folder: Option<&Path>, bytes: &[u8]) -> Result<Component> {
    let cache = folder.map(|f| Cache::new(f.to_owned(), engine));
    component(engine, cache.as_ref(), bytes)
}

/// Compiles a core module.
pub(crate) fn module(engine: &Engine, cache: Option<&Cache>, bytes: &[u8]) -> Result<Module> {
    let compile = || Module::from_binary(engine, bytes);
    let Some(cache) = cache else { return compile() };
    // SAFETY: the cache hands out only bytes that a `Module::serialize` of an equal engine gave: it verified key and
    // checksum of a file that nobody but this user can write.
    let load = |code: &[u8]| unsafe { Module::deserialize(engine, code) };
    cache.get(Kind::Module, bytes, load, compile, Module::serialize)
}

/// Compiles a component.
pub(crate) fn component(engine: &Engine, cache: Option<&Cache>, bytes: &[u8]) -> Result<Component> {
    let compile = || Component::from_binary(engine, bytes);
    let Some(cache) = cache else { return compile() };
    // SAFETY: as above, for `Component::serialize`.
    let load = |code: &[u8]| unsafe { Component::deserialize(engine, code) };
    cache.get(Kind::Component, bytes, load, compile, Component::serialize)
}
