//! What is wanted, from the command line and the files it names.

use crate::args::swap::Swap;
use anyhow::{Error, anyhow};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use latchwork_plant::swap::BlockPlan;
use serde_json::{Map, Value, json};
use std::io::Read;
use std::path::Path;

/// Bytes that the components of a swap may have together; the plant refuses more.
const LARGEST: u64 = 64 << 20;

/// One block and its next component.
struct Part {
    block: String,
    file: String,
    /// Which of the components.
    component: usize,
    settings: Map<String, Value>,
    /// Hash of what runs, as it was shown; what was agreed to is its exchange and no other.
    expects: Option<String>,
}

/// All of them.
pub(super) struct Order {
    parts: Vec<Part>,
    /// Each is sent once, for however many blocks it is.
    components: Vec<Vec<u8>>,
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
        let (mut parts, mut components): (Vec<Part>, Vec<Vec<u8>>) = Default::default();
        for pair in args.parts.chunks_exact(2) {
            let (block, path) = (&pair[0], Path::new(&pair[1]));
            if path.extension().is_none_or(|e| e != "wasm") {
                let error = format!("`{}` is to be the new component of `{block}`", path.display());
                return Err(usage(error, "expected the path of a file that ends in .wasm"));
            }
            if parts.iter().any(|p| p.block == *block) {
                return Err(usage(format!("`{block}` is named twice"), "name each block once"));
            }
            let bytes = read(path).map_err(Wrong::File)?;
            let component = components.iter().position(|c| *c == bytes).unwrap_or(components.len());
            if component == components.len() {
                components.push(bytes);
            }
            if components.iter().map(|c| c.len() as u64).sum::<u64>() > LARGEST {
                return Err(Wrong::File(too_large(path)));
            }
            let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            parts.push(Part { block: block.clone(), file, component, settings: Map::new(), expects: None });
        }
        for setting in &args.settings {
            let Some(part) = parts.iter_mut().find(|p| p.block == setting.block) else {
                let error = format!("--set names `{}`, which is not swapped", setting.block);
                return Err(usage(error, "`latchwork set` changes settings of blocks that stay as they are"));
            };
            part.settings.insert(setting.name.clone(), json!(setting.value));
        }
        Ok(Self { parts, components })
    }

    /// The blocks, for a question.
    pub(super) fn names(&self) -> String {
        self.parts.iter().map(|p| super::plain(&p.block)).collect::<Vec<_>>().join(", ")
    }

    /// Remembers what the plans that were shown begin with.
    pub(super) fn expect(&mut self, plans: &[BlockPlan]) {
        for part in &mut self.parts {
            let plan = plans.iter().find(|plan| plan.block == part.block);
            part.expects = plan.map(|plan| plan.old.hash.clone()).filter(|hash| !hash.is_empty());
        }
    }

    pub(super) fn body(&self, args: &Swap, dry_run: bool) -> Value {
        let block = |p: &Part| {
            let mut body = json!({ "block": p.block, "file": p.file, "settings": p.settings });
            match self.parts.iter().find(|first| first.component == p.component) {
                Some(first) if first.block != p.block => body["same-as"] = json!(first.block),
                _ => body["component"] = json!(BASE64_STANDARD.encode(&self.components[p.component])),
            }
            if let Some(expects) = &p.expects {
                body["expects"] = json!(expects);
            }
            body
        };
        let mut body = json!({
            "blocks": self.parts.iter().map(block).collect::<Vec<_>>(),
            "shadow": if dry_run { 0 } else { args.shadow },
            "tolerances": args.tolerance.iter().map(|(tag, within)| (tag.clone(), json!(within))).collect::<Map<_, _>>(),
            "allow-lossy": args.allow_lossy,
            "dry-run": dry_run,
            "save": args.save,
        });
        if let Some(probation) = args.probation {
            body["probation"] = json!(probation);
        }
        if let Some(reason) = &args.change.reason {
            body["reason"] = json!(reason);
        }
        body
    }
}

fn read(path: &Path) -> Result<Vec<u8>, Error> {
    let shown = path.display();
    let cannot = |e: std::io::Error| anyhow!("{shown} cannot be read: {e}");
    if path.is_dir() {
        return Err(anyhow!("{shown} is a folder; expected a component, a file that ends in .wasm"));
    }
    let mut bytes = Vec::new();
    std::fs::File::open(path).map_err(cannot)?.take(LARGEST + 1).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > LARGEST { Err(too_large(path)) } else { Ok(bytes) }
}

fn too_large(path: &Path) -> Error {
    anyhow!(
        "{} is too large: the components of a swap may have {} MiB together; `wasm-tools strip` takes away what only debuggers need",
        path.display(),
        LARGEST >> 20
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        swap: Swap,
    }

    #[test]
    fn a_component_for_several_blocks_is_sent_once_and_what_was_not_said_is_left_to_the_plant() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name).display().to_string();
        for (name, bytes) in [("one.wasm", "1"), ("two.wasm", "2"), ("copy.wasm", "1")] {
            std::fs::write(path(name), bytes).expect("a file");
        }
        let [one, two, copy] = ["one.wasm", "two.wasm", "copy.wasm"].map(path);
        let line = ["swap", "a", &one, "b", &two, "c", &one, "d", &copy, "--save"];
        let args = Line::parse_from(line).swap;
        let Ok(order) = Order::read(&args) else { panic!("it is right") };
        let body = order.body(&args, true);
        let sent = |n: usize| (body["blocks"][n]["component"].as_str(), body["blocks"][n]["same-as"].as_str());
        assert_eq!(
            [0, 1, 2, 3].map(sent),
            [(Some("MQ=="), None), (Some("Mg=="), None), (None, Some("a")), (None, Some("a"))]
        );
        assert_eq!((&body["blocks"][3]["file"], &body["save"]), (&json!("copy.wasm"), &json!(true)));
        assert!(body.get("probation").is_none(), "blocks and sinks have their own");
    }
}
