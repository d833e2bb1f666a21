//! From a core module to a component that imports nothing but the log.

use crate::class::{self, Class};
use anyhow::{Context, Result, bail};
use std::borrow::Cow;
use wasmparser::{BinaryReader, Parser, Payload};
use wit_component::{ComponentEncoder, DecodedWasm, StringEncoding};
use wit_parser::{Resolve, WorldId, WorldItem};

/// The section with the documentation of ports that `inspect` shows.
const DOCS: &str = "latchwork-docs";
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
        let mut module = without(made, &[DOCS, "name", "producers", "target_features"])?;
        rename_exports(&mut module, class)?;
        if !has_metadata(&module)? {
            wit_component::embed_component_metadata(&mut module, resolve, world, StringEncoding::UTF8)?;
        }
        encode(&module)?
    };
    let mut component = without(&component, &["name", "component-name", "producers", "package-docs", DOCS])?;
    append_section(&mut component, DOCS, class::docs(class).to_string().as_bytes());
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
fn rename_exports(module: &mut Vec<u8>, class: &Class) -> Result<()> {
    const EXPORTS: u8 = 7;
    let functions = ["defaults", "configure", "execute", "save", "restore"];
    let (header, sections) = module.split_at_checked(8).context("no wasm header")?;
    let mut out = header.to_vec();
    let mut reader = BinaryReader::new(sections, 0);
    while !reader.eof() {
        let id = reader.read_u8()?;
        let size = reader.read_var_u32()? as usize;
        let mut body = Cow::from(reader.read_bytes(size)?);
        if id == EXPORTS {
            let mut exports = BinaryReader::new(&body, 0);
            let count = exports.read_var_u32()?;
            let mut renamed = Vec::new();
            leb128(&mut renamed, count as usize);
            for _ in 0..count {
                let name = exports.read_string()?;
                let function = name.strip_prefix("latchwork_").filter(|f| functions.contains(f));
                let name = function.map_or_else(|| name.to_owned(), |f| format!("{}#{f}", class.id));
                leb128(&mut renamed, name.len());
                renamed.extend_from_slice(name.as_bytes());
                renamed.push(exports.read_u8()?);
                leb128(&mut renamed, exports.read_var_u32()? as usize);
            }
            body = renamed.into();
        }
        out.push(id);
        leb128(&mut out, body.len());
        out.extend_from_slice(&body);
    }
    *module = out;
    Ok(())
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

/// The same module or component without the named custom sections, in the modules inside it too.
fn without(bytes: &[u8], names: &[&str]) -> Result<Vec<u8>> {
    const CUSTOM: u8 = 0;
    const CORE_MODULE: u8 = 1;
    let (header, sections) = bytes.split_at_checked(8).context("no wasm header")?;
    // Bytes 6 and 7 tell a component from a module, in which section 1 means something else.
    let component = header[6..] == [1, 0];
    let mut out = header.to_vec();
    let mut reader = BinaryReader::new(sections, 0);
    while !reader.eof() {
        let id = reader.read_u8()?;
        let size = reader.read_var_u32()? as usize;
        let body = reader.read_bytes(size)?;
        let body: Cow<'_, [u8]> = match id {
            CUSTOM if names.contains(&BinaryReader::new(body, 0).read_string()?) => continue,
            CORE_MODULE if component => without(body, names)?.into(),
            _ => body.into(),
        };
        out.push(id);
        leb128(&mut out, body.len());
        out.extend_from_slice(&body);
    }
    Ok(out)
}

fn append_section(component: &mut Vec<u8>, name: &str, data: &[u8]) {
    let mut body = Vec::new();
    leb128(&mut body, name.len());
    body.extend_from_slice(name.as_bytes());
    body.extend_from_slice(data);
    component.push(0);
    leb128(component, body.len());
    component.extend_from_slice(&body);
}

fn leb128(out: &mut Vec<u8>, mut value: usize) {
    loop {
        let byte = (value & 0x7f) as u8;
        value >>= 7;
        if value == 0 {
            out.push(byte);
            return;
        }
        out.push(byte | 0x80);
    }
}
