//! Makes the object file with the one instruction Rust will not write: a division that nobody checks before.
//!
//! Rust guards every division by zero with a panic, which traps as `unreachable`; the host is to meet the division's own
//! trap, too. Inline assembly is not stable for wasm, so this is a relocatable module of one function for the linker.

use std::path::PathBuf;
use wasm_encoder::{CodeSection, Function, FunctionSection, LinkingSection, Module, SymbolTable, TypeSection, ValType};

fn main() -> std::io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_ARCH").as_deref() != Ok("wasm32") {
        return Ok(());
    }
    let object = PathBuf::from(std::env::var_os("OUT_DIR").unwrap_or_default()).join("divide.o");
    std::fs::write(&object, divide())?;
    println!("cargo::rustc-link-arg-cdylib={}", object.display());
    Ok(())
}

/// `stress_divide: func(a: i32, b: i32) -> i32 { a / b }`
fn divide() -> Vec<u8> {
    let mut types = TypeSection::new();
    types.ty().function([ValType::I32, ValType::I32], [ValType::I32]);
    let mut functions = FunctionSection::new();
    functions.function(0);
    let mut body = Function::new([]);
    body.instructions().local_get(0).local_get(1).i32_div_u().end();
    let mut code = CodeSection::new();
    code.function(&body);
    let mut symbols = SymbolTable::new();
    symbols.function(0, 0, Some("stress_divide"));
    let mut linking = LinkingSection::new();
    linking.symbol_table(&symbols);

    let mut module = Module::new();
    module.section(&types).section(&functions).section(&code).section(&linking);
    module.finish()
}
