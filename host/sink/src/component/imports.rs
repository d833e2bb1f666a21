//! What a logger asks for, read without compiling it.

use wasmparser::{Parser, Payload};

/// The interface that makes a component a logger.
const SINK: &str = "latchwork:journal/sink@0.1.";

/// What a logger may import. WASI's files and sockets reach what the plant file grants.
const ALLOWED: [&str; 10] = [
    "latchwork:block/log@0.1.",
    "latchwork:block/types@0.1.",
    "latchwork:journal/types@0.1.",
    "wasi:cli/",
    "wasi:clocks/",
    "wasi:filesystem/",
    "wasi:io/",
    "wasi:random/",
    "wasi:sockets/",
    // Core types alone.
    "latchwork:journal/sink@0.1.",
];

/// What a logger imports, besides types; or why bytes are none, and the way out.
pub(super) fn check(bytes: &[u8]) -> Result<Vec<String>, (String, String)> {
    match bytes {
        [0, b'a', b's', b'm', 0x0d, 0, 1, 0, ..] => {}
        [0, b'a', b's', b'm', ..] => {
            return Err((
                "this is WebAssembly, but no component".into(),
                "build for the world `latchwork:journal/logger` (Rust: the target wasm32-wasip2), or wrap the module with \
                 `wasm-tools component new`"
                    .into(),
            ));
        }
        _ => {
            return Err(("this is no WebAssembly".into(), "name the file that the build of the logger wrote".into()));
        }
    }
    let damaged = |e: wasmparser::BinaryReaderError| {
        (
            format!("the component is damaged: {} (at byte {})", e.message(), e.offset()),
            "build or copy it again".to_owned(),
        )
    };
    let (imports, exports) = names(bytes).map_err(damaged)?;
    let refused: Vec<_> = imports.iter().filter(|name| !allowed(name)).map(|name| format!("\"{name}\"")).collect();
    if !refused.is_empty() {
        let help = if refused.iter().any(|name| name.starts_with("\"wasi:http/")) {
            "speak HTTP over a TCP connection of `connect`, or build without that dependency"
        } else if refused.iter().any(|name| name.contains("@0.3") || name.contains("@0.1.0\"")) {
            "build it for WASI 0.2 and latchwork:journal@0.1.0"
        } else {
            "build it without the dependency that wants that"
        };
        return Err((
            format!("the logger imports {}; it may import WASI 0.2 and latchwork:block/log", refused.join(", ")),
            help.into(),
        ));
    }
    if exports.iter().any(|name| name.starts_with(SINK)) {
        let types = |name: &String| name.contains("/types@") || name.starts_with(SINK);
        return Ok(imports.into_iter().filter(|name| !types(name)).collect());
    }
    let exports: Vec<_> = exports.iter().map(|name| format!("\"{name}\"")).collect();
    let what = if exports.is_empty() { "nothing".into() } else { exports.join(", ") };
    Err((
        format!("the component exports {what}; expected \"latchwork:journal/sink@0.1.0\""),
        "build it for the world `latchwork:journal/logger`; a function block belongs into [block.NAME]".into(),
    ))
}

fn allowed(import: &str) -> bool {
    ALLOWED.iter().any(|prefix| import.starts_with(prefix))
        && (!import.starts_with("wasi:") || import.contains("@0.2."))
}

/// Names of the component's own imports and exports, not of those inside it.
fn names(bytes: &[u8]) -> Result<(Vec<String>, Vec<String>), wasmparser::BinaryReaderError> {
    let (mut imports, mut exports, mut depth) = (Vec::new(), Vec::new(), 0u32);
    for payload in Parser::new(0).parse_all(bytes) {
        match payload? {
            Payload::ModuleSection { .. } | Payload::ComponentSection { .. } => depth += 1,
            Payload::End(_) => depth = depth.saturating_sub(1),
            Payload::ComponentImportSection(section) if depth == 0 => {
                for import in section {
                    imports.push(import?.name.name.to_owned());
                }
            }
            Payload::ComponentExportSection(section) if depth == 0 => {
                for export in section {
                    exports.push(export?.name.name.to_owned());
                }
            }
            _ => {}
        }
    }
    Ok((imports, exports))
}
