//! A core module becomes a component: encoded, validated, documented, and without what only a debugger reads.

use anyhow::{Context, Result};
use serde_json::{Map, Value};
use std::borrow::Cow;
use wasmparser::{BinaryReader, Parser, Payload};

/// The section that carries the documentation of the classes: one JSON object, class → `{class, ports}`.
const DOCS: &str = "latchwork-docs";

/// Makes the component of a core module that the SDK (or any wit-bindgen) built.
pub(super) fn from_module(module: &[u8]) -> Result<Vec<u8>> {
    let docs = docs(module)?;
    let module = without(module, &[DOCS, "name", "producers", "target_features"])?;
    let component = wit_component::ComponentEncoder::default().validate(true).module(&module)?.encode()?;
    let mut component = without(&component, &["name", "component-name", "producers"])?;
    if !docs.is_empty() {
        append_section(&mut component, DOCS, Value::Object(docs).to_string().as_bytes());
    }
    Ok(component)
}

/// A logger, which the linker made a component already.
pub(super) fn from_component(component: &[u8]) -> Result<Vec<u8>> {
    without(component, &["name", "component-name", "producers", "target_features"])
}

/// The documentation of all classes of a module: the linker puts the objects of several blocks one after the other.
fn docs(module: &[u8]) -> Result<Map<String, Value>> {
    let mut all = Map::new();
    for payload in Parser::new(0).parse_all(module) {
        if let Payload::CustomSection(section) = payload?
            && section.name() == DOCS
        {
            for value in serde_json::Deserializer::from_slice(section.data()).into_iter::<Map<String, Value>>() {
                all.extend(value.with_context(|| format!("the section {DOCS} is no JSON"))?);
            }
        }
    }
    Ok(all)
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
        push_length(&mut out, body.len());
        out.extend_from_slice(&body);
    }
    Ok(out)
}

fn append_section(component: &mut Vec<u8>, name: &str, data: &[u8]) {
    let mut body = Vec::with_capacity(name.len() + data.len() + 5);
    push_length(&mut body, name.len());
    body.extend_from_slice(name.as_bytes());
    body.extend_from_slice(data);
    component.push(0);
    push_length(component, body.len());
    component.extend_from_slice(&body);
}

/// LEB128, as all lengths in wasm.
fn push_length(out: &mut Vec<u8>, mut length: usize) {
    while length > 0x7f {
        out.push((length & 0x7f) as u8 | 0x80);
        length >>= 7;
    }
    out.push(length as u8);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documentation_of_two_blocks_in_one_module_is_merged() {
        let mut module = b"\0asm\x01\0\0\0".to_vec();
        append_section(&mut module, DOCS, br#"{"a:b/c@1.0.0":{"class":"one"}}{"a:b/d@1.0.0":{"class":"two"}}"#);
        let docs = docs(&module).unwrap();
        assert_eq!(docs["a:b/c@1.0.0"]["class"], "one");
        assert_eq!(docs["a:b/d@1.0.0"]["class"], "two");
    }

    #[test]
    fn named_sections_vanish_also_inside_a_component_and_all_else_stays() {
        let mut inner = b"\0asm\x01\0\0\0".to_vec();
        append_section(&mut inner, "keep", &[7; 300]);
        let kept = inner.clone();
        append_section(&mut inner, "name", &[1, 2, 3]);
        let wrap = |module: &[u8]| {
            let mut out = b"\0asm\x0d\0\x01\0\x01".to_vec();
            push_length(&mut out, module.len());
            out.extend_from_slice(module);
            out
        };
        assert_eq!(without(&wrap(&inner), &["name"]).unwrap(), wrap(&kept));
    }
}
