//! Reads a component's device classes from its types and checks them against the pattern of the contract.
//!
//! Nothing is compiled here: a component that is refused costs no more than its validation.

mod class;
mod docs;
mod foreign;
mod shape;
mod signature;
mod types;

pub(crate) use class::ClassInterface;
pub(crate) use shape::Shape;
pub(crate) use signature::{Function, Returns, Signature, fuel};

use crate::LoadError;
use std::ops::Range;
use wasmparser::component_types::{ComponentAnyTypeId, ComponentEntityType};
use wasmparser::types::TypesRef;
use wasmparser::{Parser, Payload, Validator, WasmFeatures};

/// The interface whose function `write` a block may import.
const LOG: &str = "latchwork:block/log";

/// What a component's types say.
pub(crate) struct Interface {
    /// Imports besides those that hold types only.
    pub(crate) imports: Vec<String>,
    /// Device classes, at least one, in the order of the exports.
    pub(crate) classes: Vec<ClassInterface>,
}

/// Features of the language a component may use: what the engine compiles too.
pub(crate) fn features() -> WasmFeatures {
    WasmFeatures::default()
}

/// Validates a component and reads its classes.
pub(crate) fn read(bytes: &[u8]) -> Result<Interface, LoadError> {
    foreign::refuse(bytes)?;
    let damaged = |e: wasmparser::BinaryReaderError| LoadError::Damaged {
        reason: e.message().to_string(),
        offset: e.offset(),
        size: bytes.len(),
    };
    let types = Validator::new_with_features(features()).validate_all(bytes).map_err(damaged)?;
    let outline = outline(bytes).map_err(damaged)?;
    let types = types.as_ref();
    let imports = imports(types, &outline.imports)?;
    let mut docs = outline.docs.map(|r| docs::read(&bytes[r])).unwrap_or_default();
    let mut classes = Vec::new();
    for name in &outline.exports {
        let Some(ComponentEntityType::Instance(id)) = types.component_item_for_export(name).map(|i| i.ty) else {
            continue;
        };
        let exports = &types[id].exports;
        if !exports.get("execute").is_some_and(|e| matches!(e.ty, ComponentEntityType::Func(_))) {
            continue;
        }
        classes.push(class::read(types, name, id, docs.remove(name).unwrap_or_default())?);
    }
    if classes.is_empty() {
        return Err(LoadError::NoClass { exports: outline.exports });
    }
    Ok(Interface { imports, classes })
}

/// Names and sections at the component's own level.
#[derive(Default)]
struct Outline {
    imports: Vec<String>,
    exports: Vec<String>,
    docs: Option<Range<usize>>,
}

fn outline(bytes: &[u8]) -> Result<Outline, wasmparser::BinaryReaderError> {
    let mut outline = Outline::default();
    let mut depth = 0;
    for payload in Parser::new(0).parse_all(bytes) {
        match payload? {
            Payload::Version { .. } => depth += 1,
            Payload::End(_) => depth -= 1,
            _ if depth != 1 => {}
            Payload::ComponentImportSection(section) => {
                for import in section {
                    outline.imports.push(import?.name.name.to_string());
                }
            }
            Payload::ComponentExportSection(section) => {
                for export in section {
                    outline.exports.push(export?.name.name.to_string());
                }
            }
            Payload::CustomSection(section) if section.name() == docs::SECTION => {
                outline.docs = Some(section.data_offset()..section.data_offset() + section.data().len());
            }
            _ => {}
        }
    }
    Ok(outline)
}

/// The imports that matter; an error names all that are forbidden.
fn imports(types: TypesRef<'_>, names: &[String]) -> Result<Vec<String>, LoadError> {
    let (mut allowed, mut forbidden) = (Vec::new(), Vec::new());
    for name in names {
        let Some(item) = types.component_item_for_import(name) else { continue };
        let only_types = match item.ty {
            ComponentEntityType::Type { referenced, .. } => is_plain_type(referenced),
            ComponentEntityType::Instance(id) => types[id]
                .exports
                .values()
                .all(|e| matches!(e.ty, ComponentEntityType::Type { referenced, .. } if is_plain_type(referenced))),
            _ => false,
        };
        if only_types {
            continue;
        }
        if is_log(name) {
            class::check_log(types, name, item)?;
            allowed.push(name.clone());
        } else {
            forbidden.push(name.clone());
        }
    }
    if forbidden.is_empty() { Ok(allowed) } else { Err(forbidden_imports(forbidden)) }
}

fn is_plain_type(id: ComponentAnyTypeId) -> bool {
    !matches!(id, ComponentAnyTypeId::Resource(_))
}

/// `latchwork:block/log`, in the version this runtime knows.
pub(crate) fn is_log(name: &str) -> bool {
    name.strip_prefix(LOG).is_some_and(|v| v.is_empty() || v.starts_with("@0.1."))
}

fn forbidden_imports(imports: Vec<String>) -> LoadError {
    let first = &imports[0];
    let way_out = if first.starts_with("wasi:") {
        "A block has no files, clock or network, so it needs no WASI: in Rust build for wasm32-unknown-unknown, in C \
         with -nostdlib or a reactor, elsewhere with stubs in place of WASI"
            .into()
    } else if first.starts_with(LOG) {
        "This runtime knows version 0.1 of it: build the block against that".into()
    } else if first.starts_with("latchwork:") || first.contains('/') {
        "An interface that a block calls is to be composed into the component before it is loaded".into()
    } else {
        "Take the import out of the world the block is built for".into()
    };
    LoadError::Import { imports, way_out }
}
