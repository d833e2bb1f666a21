//! What is wanted, from the command line and the files it names.

use crate::args::swap::Swap;
use anyhow::{Error, anyhow};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde_json::{Map, Value, json};
use std::io::Read;
use std::path::Path;

/// Bytes that the components of a swap may have together; the plant refuses more.
const LARGEST: u64 = 64 << 20;

/// One block and its next component.
struct Part {
    block: String,
    file: String,
    bytes: Vec<u8>,
    settings: Map<String, Value>,
}

/// All of them.
pub(super) struct Order {
    parts: Vec<Part>,
}

/// Why there is nothing to send.
pub(super) enum Wrong {
    /// The command line.
    Usage {
        /// What was found.
        error: String,
        /// The way out.
        help: String,
    },
    /// A file.
    File(Error),
}

impl Order {
    pub(super) fn read(args: &Swap) -> Result<Self, Wrong> {
        let usage = |error: String, help: &str| Wrong::Usage { error, help: help.into() };
        if !args.parts.len().is_multiple_of(2) {
            let alone = &args.parts[args.parts.len() - 1];
            return Err(usage(
                format!("`{alone}` stands alone"),
                "name each block with the file of its new component: latchwork swap BLOCK NEW.wasm [BLOCK NEW.wasm …]",
            ));
        }
        let mut parts: Vec<Part> = Vec::new();
        for pair in args.parts.chunks_exact(2) {
            let (block, path) = (&pair[0], Path::new(&pair[1]));
            if path.extension().is_none_or(|e| e != "wasm") {
                let error = format!("`{}` is to be the new component of `{block}`", path.display());
                return Err(usage(error, "expected the path of a file that ends in .wasm"));
            }
            if parts.iter().any(|p| p.block == *block) {
                return Err(usage(format!("`{block}` is named twice"), "name each block once"));
            }
            let left = LARGEST - parts.iter().map(|p| p.bytes.len() as u64).sum::<u64>();
            let bytes = read(path, left).map_err(Wrong::File)?;
            let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            parts.push(Part { block: block.clone(), file, bytes, settings: Map::new() });
        }
        for setting in &args.settings {
            let Some(part) = parts.iter_mut().find(|p| p.block == setting.block) else {
                let error = format!("--set names `{}`, which is not swapped", setting.block);
                return Err(usage(error, "`latchwork set` changes settings of blocks that stay as they are"));
            };
            part.settings.insert(setting.name.clone(), json!(setting.value));
        }
        Ok(Self { parts })
    }

    /// The blocks, for a question.
    pub(super) fn names(&self) -> String {
        self.parts.iter().map(|p| super::plain(&p.block)).collect::<Vec<_>>().join(", ")
    }

    pub(super) fn body(&self, args: &Swap, dry_run: bool) -> Value {
        let block = |p: &Part| {
            let component = BASE64_STANDARD.encode(&p.bytes);
            json!({ "block": p.block, "file": p.file, "component": component, "settings": p.settings })
        };
        let mut body = json!({
            "blocks": self.parts.iter().map(block).collect::<Vec<_>>(),
            "shadow": if dry_run { 0 } else { args.shadow },
            "tolerances": args.tolerance.iter().map(|(tag, within)| (tag.clone(), json!(within))).collect::<Map<_, _>>(),
            "probation": args.probation,
            "allow-lossy": args.allow_lossy,
            "dry-run": dry_run,
            "save": args.save && !dry_run,
        });
        if let Some(reason) = &args.change.reason {
            body["reason"] = json!(reason);
        }
        body
    }
}

fn read(path: &Path, left: u64) -> Result<Vec<u8>, Error> {
    let shown = path.display();
    let cannot = |e: std::io::Error| anyhow!("{shown} cannot be read: {e}");
    if path.is_dir() {
        return Err(anyhow!("{shown} is a folder; expected a component, a file that ends in .wasm"));
    }
    let mut bytes = Vec::new();
    std::fs::File::open(path).map_err(cannot)?.take(left + 1).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > left {
        return Err(anyhow!(
            "{shown} is too large: the components of a swap may have {} MiB together; `wasm-tools strip` takes away what only \
             debuggers need",
            LARGEST >> 20
        ));
    }
    Ok(bytes)
}
