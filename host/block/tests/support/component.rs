//! Core module and WIT to component, the way any tool chain does it.

use super::class::Spec;
use super::evil::{Evil, When};
use super::guest;
use std::path::Path;
use wit_component::{ComponentEncoder, StringEncoding, dummy_module, embed_component_metadata};
use wit_parser::{ManglingAndAbi, Resolve, SourceMap, WorldId};

/// A component of a generated class.
pub fn generated(spec: &Spec, evil: Evil, when: When) -> Vec<u8> {
    // A log that only the hostile part uses must be imported, too.
    let spec_wit = Spec { log: spec.log || evil.logs(), ..spec.clone() }.wit();
    component(&spec_wit, &guest::wat(spec, evil, when))
}

/// A component out of the WIT text of its package, whose only world is `w`, and a core module as text.
pub fn component(wit: &str, wat: &str) -> Vec<u8> {
    let (resolve, world) = resolve(&[], wit);
    let module = wat::parse_str(wat).unwrap_or_else(|e| panic!("{e}\n{wat}"));
    encode(&resolve, world, module).unwrap_or_else(|e| panic!("{e:#}\n{wit}"))
}

/// A component that has the shape of the WIT and no sense: every function traps. `others` are packages it uses.
pub fn dummy(others: &[&str], wit: &str) -> Vec<u8> {
    let (resolve, world) = resolve(others, wit);
    let module = dummy_module(&resolve, world, ManglingAndAbi::Legacy(wit_parser::LiftLowerAbi::Sync));
    encode(&resolve, world, module).unwrap_or_else(|e| panic!("{e:#}\n{wit}"))
}

/// The WIT alone, encoded as a component.
pub fn wit_only(wit: &str) -> Vec<u8> {
    let (resolve, world) = resolve(&[], wit);
    wit_component::encode(&resolve, resolve.worlds[world].package.unwrap()).unwrap()
}

fn resolve(others: &[&str], wit: &str) -> (Resolve, WorldId) {
    let mut resolve = Resolve::default();
    let mut push = |texts: &[(&str, &str)]| {
        let mut map = SourceMap::default();
        for (path, text) in texts {
            map.push(Path::new(path), *text);
        }
        let group = map.parse().unwrap_or_else(|(_, e)| panic!("{e:?}\n{texts:?}"));
        resolve.push_group(group).unwrap_or_else(|e| panic!("{e:#}\n{texts:?}"))
    };
    for package in latchwork_wit::PACKAGES {
        push(package.files);
    }
    for other in others {
        push(&[("other.wit", *other)]);
    }
    let package = push(&[("test.wit", wit)]);
    let world = resolve.select_world(&[package], Some("w")).unwrap_or_else(|e| panic!("{e:#}\n{wit}"));
    (resolve, world)
}

fn encode(resolve: &Resolve, world: WorldId, mut module: Vec<u8>) -> anyhow::Result<Vec<u8>> {
    embed_component_metadata(&mut module, resolve, world, StringEncoding::UTF8)?;
    ComponentEncoder::default().module(&module)?.validate(true).encode()
}

/// The component with one more custom section.
pub fn with_section(component: &[u8], name: &str, data: &[u8]) -> Vec<u8> {
    use wasm_encoder::{ComponentSection as _, CustomSection};
    let mut bytes = component.to_vec();
    CustomSection { name: name.into(), data: data.into() }.append_to_component(&mut bytes);
    bytes
}
