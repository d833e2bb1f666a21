//! From a core module to a component that imports nothing but the log.

use crate::class::{self, Class};
use anyhow::{Context, Result, bail};
use latchwork_sections::{DOCS, append, push_length, rewrite, without};
use wasmparser::{BinaryReader, Parser, Payload};
use wit_component::{ComponentEncoder, DecodedWasm, StringEncoding};
use wit_parser::{Resolve, WorldId, WorldItem};

/// The interface that the C library and Go's runtime call.
const WASI: &str = "wasi_snapshot_preview1";
/// What glue exports for the stand-in's clock.
const NOW: &str = "latchwork_now";

/// The stand-in for WASI preview 1, as WAT.
///
/// A block with it has no files, no arguments, no environment. Its clock is plant time (at least 1 ns: Go's runtime takes 0 for
/// a fault), its random numbers are a fixed sequence from the start of each instance, what it writes is swallowed, and a sleep
/// or an exit is a trap.
pub const WASI_STUB: &str = include_str!("stub/wasi.wat");

/// Makes the component of a core module, or takes one that the language's tool has made.
pub(crate) fn make(made: &[u8], resolve: &Resolve, world: WorldId, class: &Class) -> Result<Vec<u8>> {
    let component = if Parser::is_component(made) {
        made.to_vec()
    } else {
        let module = without(made, &[DOCS, "name", "producers", "target_features"])?;
        let mut module = rename_exports(&module, class)?;
        if !has_metadata(&module)? {
            wit_component::embed_component_metadata(&mut module, resolve, world, StringEncoding::UTF8)?;
        }
        encode(&module)?
    };
    let mut component = without(&component, &["name", "component-name", "producers", "package-docs", DOCS])?;
    append(&mut component, DOCS, class::docs(class).to_string().as_bytes());
    Ok(component)
}

fn encode(module: &[u8]) -> Result<Vec<u8>> {
    let needs = needs(module)?;
    let mut encoder = ComponentEncoder::default().validate(true).module(module)?;
    for name in &needs.modules {
        let stub = match name.as_str() {
            WASI => stub(needs.clock)?,
            // An interface: the encoder knows which there are.
            name if name.contains(':') => continue,
            other => bail!(
                "it imports from `{other}`, which no block gets; look for a clock, a random number, or a function that was not linked"
            ),
        };
        encoder = encoder.adapter(name, &stub)?;
    }
    encoder.encode()
}

/// The stand-in for WASI; one whose clock stands where the module does not tell the time.
fn stub(clock: bool) -> Result<Vec<u8>> {
    let import = "(import \"__main_module__\" \"latchwork_now\" (func $now (result i64)))";
    let text = match clock {
        true => WASI_STUB.to_owned(),
        false => WASI_STUB.replace(import, "(func $now (result i64) (i64.const 1))"),
    };
    wat::parse_str(text).context("the stand-in for WASI")
}

struct Needs {
    /// Names of modules that it imports from, once each.
    modules: Vec<String>,
    /// It tells the plant's time.
    clock: bool,
}

fn needs(module: &[u8]) -> Result<Needs> {
    let mut needs = Needs { modules: Vec::new(), clock: false };
    for payload in Parser::new(0).parse_all(module) {
        match payload? {
            Payload::ImportSection(section) => {
                for import in section.into_imports() {
                    let import = import?;
                    if !needs.modules.iter().any(|m| m == import.module) {
                        needs.modules.push(import.module.to_owned());
                    }
                }
            }
            Payload::ExportSection(section) => {
                for export in section {
                    needs.clock |= export?.name == NOW;
                }
            }
            _ => {}
        }
    }
    Ok(needs)
}

fn has_metadata(module: &[u8]) -> Result<bool> {
    for payload in Parser::new(0).parse_all(module) {
        if let Payload::CustomSection(section) = payload?
            && section.name().starts_with("component-type")
        {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Gives exports of the glue of languages that allow only identifiers there their names: `latchwork_execute` is `CLASS#execute`.
fn rename_exports(module: &[u8], class: &Class) -> Result<Vec<u8>> {
    const EXPORTS: u8 = 7;
    let functions = ["defaults", "configure", "execute", "save", "restore"];
    rewrite(module, |id, body| {
        if id != EXPORTS {
            return Ok(Some(body.into()));
        }
        let mut exports = BinaryReader::new(body, 0);
        let count = exports.read_var_u32()?;
        let mut renamed = Vec::new();
        push_length(&mut renamed, count as usize);
        for _ in 0..count {
            let name = exports.read_string()?;
            let function = name.strip_prefix("latchwork_").filter(|f| functions.contains(f));
            let name = function.map_or_else(|| name.to_owned(), |f| format!("{}#{f}", class.id));
            push_length(&mut renamed, name.len());
            renamed.extend_from_slice(name.as_bytes());
            renamed.push(exports.read_u8()?);
            push_length(&mut renamed, exports.read_var_u32()? as usize);
        }
        Ok(Some(renamed.into()))
    })
}

/// Interfaces with functions that a component imports; an error if it does not export the class.
pub(crate) fn imports(bytes: &[u8], class: &Class) -> Result<Vec<String>> {
    let DecodedWasm::Component(resolve, world) = wit_component::decode(bytes)? else { bail!("it is no component") };
    let world = &resolve.worlds[world];
    if !world.exports.keys().any(|key| resolve.name_world_key(key) == class.id) {
        bail!("it does not export {}", class.id);
    }
    let asks = |item: &WorldItem| match item {
        WorldItem::Interface { id, .. } => !resolve.interfaces[*id].functions.is_empty(),
        WorldItem::Function(_) => true,
        WorldItem::Type { .. } => false,
    };
    Ok(world.imports.iter().filter(|(_, i)| asks(i)).map(|(key, _)| resolve.name_world_key(key)).collect())
}
