//! Blocks of the examples in C: clang makes a core module, the classes' WIT makes a component of it.

use super::write_if_changed;
use crate::cargo::{root, run};
use anyhow::{Context, Result};
use std::path::Path;
use std::process::Command;
use wit_component::StringEncoding;
use wit_parser::Resolve;

/// What builds them, with Debian's package.
pub(crate) const TOOLS: &[(&str, &str)] = &[("clang-19", "clang-19"), ("wasm-ld-19", "lld-19")];

/// A block in C.
struct Block {
    name: &'static str,
    /// Its source, from the root.
    source: &'static str,
    /// Folder of the WIT package of its class.
    wit: &'static str,
    class: &'static str,
}

const BLOCKS: &[Block] = &[Block {
    name: "pump-hours-c",
    source: "examples/hot-swap/pump-hours-c/pump-hours.c",
    wit: "examples/hot-swap/pump-hours-2/wit",
    class: "waterworks:pump/pump-hours@0.2.0",
}];

/// True for the name of one of them.
pub(super) fn is_one(name: &str) -> bool {
    BLOCKS.iter().any(|b| b.name == name)
}

/// Builds all of them into a folder.
pub(super) fn build(out: &Path) -> Result<()> {
    std::fs::create_dir_all(out).with_context(|| format!("cannot make the folder {}", out.display()))?;
    for block in BLOCKS {
        eprintln!("building {}", block.name);
        let draft = out.join(format!("{}.core", block.name));
        let mut clang = Command::new("clang-19");
        clang.args(["--target=wasm32", "-Os", "-nostdlib", "-Wall", "-Wextra", "-Werror"]);
        for flag in ["--no-entry", "--export-memory", "--strip-all", "-zstack-size=16384"] {
            clang.arg(format!("-Wl,{flag}"));
        }
        run(clang.arg("-o").arg(&draft).arg(block.source).current_dir(root()))?;
        let module = std::fs::read(&draft).with_context(|| format!("clang wrote no {}", draft.display()))?;
        let component =
            component(block, module).with_context(|| format!("{}: no component can be made", block.name))?;
        std::fs::remove_file(&draft).with_context(|| format!("cannot remove {}", draft.display()))?;
        write_if_changed(&out.join(format!("{}.wasm", block.name)), &component)?;
    }
    Ok(())
}

fn component(block: &Block, mut module: Vec<u8>) -> Result<Vec<u8>> {
    let mut resolve = Resolve::default();
    resolve.push_dir(root().join("wit/block"))?;
    resolve.push_dir(root().join(block.wit))?;
    let world = format!("package latchwork:example;\nworld block {{ export {}; }}\n", block.class);
    let package = resolve.push_str("block.wit", &world)?;
    let world = resolve.select_world(&[package], Some("block"))?;
    wit_component::embed_component_metadata(&mut module, &resolve, world, StringEncoding::UTF8)?;
    wit_component::ComponentEncoder::default().validate(true).module(&module)?.encode()
}
