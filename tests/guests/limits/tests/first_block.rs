//! `docs/first-block.md` shows the guest `pump-station`, which is built and tested like every other.

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../..")
}

fn text(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

#[test]
fn the_page_shows_the_block_as_it_is() {
    let page = text("docs/first-block.md");
    let rust = text("tests/guests/pump-station/src/lib.rs");
    let (block, tests) = rust.split_once("\n#[cfg(test)]").expect("a block and its tests");
    let fence = |language: &str, code: &str| format!("```{language}\n{code}```\n");
    for code in [
        fence("wit", &text("tests/guests/pump-station/wit/pump-station.wit")),
        fence("rust", block),
        fence("rust", &format!("#[cfg(test)]{tests}")),
    ] {
        assert!(page.contains(&code), "docs/first-block.md lacks\n{code}");
    }
}
