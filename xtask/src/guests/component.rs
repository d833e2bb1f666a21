//! A core module becomes a component: encoded, validated, documented, and without what only a debugger reads.

use anyhow::{Context, Result};
use latchwork_sections::{DOCS, append, without};
use serde_json::{Map, Value};
use wasmparser::{Parser, Payload};

/// Makes the component of a core module that the SDK (or any wit-bindgen) built.
pub(super) fn from_module(module: &[u8]) -> Result<Vec<u8>> {
    let docs = docs(module)?;
    let module = without(module, &[DOCS, "name", "producers", "target_features"])?;
    let component = wit_component::ComponentEncoder::default().validate(true).module(&module)?.encode()?;
    let mut component = without(&component, &["name", "component-name", "producers"])?;
    if !docs.is_empty() {
        append(&mut component, DOCS, Value::Object(docs).to_string().as_bytes());
    }
    Ok(component)
}

/// A logger, which the linker made a component already.
pub(super) fn from_component(component: &[u8]) -> Result<Vec<u8>> {
    Ok(without(component, &["name", "component-name", "producers", "target_features"])?)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documentation_of_two_blocks_in_one_module_is_merged() {
        let mut module = b"\0asm\x01\0\0\0".to_vec();
        append(&mut module, DOCS, br#"{"a:b/c@1.0.0":{"class":"one"}}{"a:b/d@1.0.0":{"class":"two"}}"#);
        let docs = docs(&module).unwrap();
        assert_eq!(docs["a:b/c@1.0.0"]["class"], "one");
        assert_eq!(docs["a:b/d@1.0.0"]["class"], "two");
    }
}
