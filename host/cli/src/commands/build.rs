//! `latchwork build DIR`

use crate::Exit;
use crate::args::author::Build;
use crate::report;
use anyhow::Result;
use serde_json::json;

pub(super) fn execute(args: &Build) -> Result<Exit> {
    let built = latchwork_author::build(&args.folder, &mut |command| eprintln!("$ {command}")).inspect_err(|_| {
        if let Some(old) = latchwork_author::built_before(&args.folder) {
            eprintln!(
                "note: {} is what an earlier build has made; tests of it say nothing of this source",
                old.display()
            );
        }
    })?;
    let path = built.path.strip_prefix(".").unwrap_or(&built.path).display().to_string();
    if args.json {
        let json = json!({ "path": path, "class": built.class, "bytes": built.bytes, "imports": built.imports });
        report::say(&format!("{}\n", serde_json::to_string_pretty(&json)?));
    } else {
        let imports = if built.imports.is_empty() { "nothing".to_owned() } else { built.imports.join(", ") };
        report::say(&format!("{path}: {}, {} bytes, imports {imports}\n", built.class, built.bytes));
    }
    Ok(Exit::Fine)
}
