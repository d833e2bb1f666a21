//! Where the built components are. A test without them fails and says what to do; it does not skip.

use std::path::PathBuf;

/// Cargo's target folder: this test was built in it.
fn target() -> PathBuf {
    let given = std::env::var_os("CARGO_TARGET_DIR").map(PathBuf::from).filter(|p| p.is_absolute());
    given.unwrap_or_else(|| {
        let exe = std::env::current_exe().unwrap();
        // TARGET/release/deps/NAME-HASH
        exe.ancestors().nth(3).unwrap().to_owned()
    })
}

/// The function blocks in `TARGET/FOLDER`, in the order of their names. Loggers are there, too.
pub fn shipped(folder: &str) -> Vec<PathBuf> {
    let folder = target().join(folder);
    let mut found: Vec<PathBuf> = std::fs::read_dir(&folder)
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "wasm"))
        .filter(|path| !is_logger(&std::fs::read(path).unwrap()))
        .collect();
    assert!(!found.is_empty(), "no components in {}: run `cargo xtask guests` first", folder.display());
    found.sort();
    found
}

fn is_logger(component: &[u8]) -> bool {
    let sink = b"latchwork:journal/sink@";
    component.windows(sink.len()).any(|bytes| bytes == sink)
}

/// One component of the tests' own.
pub fn test_component(name: &str) -> Vec<u8> {
    let path = target().join("test-components").join(name).with_extension("wasm");
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}: run `cargo xtask guests` first", path.display()))
}
