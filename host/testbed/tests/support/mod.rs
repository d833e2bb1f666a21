//! What the tests of the testbed share. Needs `cargo xtask guests`.

use latchwork_block::{Engine, EngineOptions, Ticker};
use latchwork_testbed::case::{CaseReport, Checked, Options, check_text};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Period of the epoch while tests run.
const TICK: Duration = Duration::from_millis(10);

/// The build folder.
pub(crate) fn target() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder").to_path_buf()
}

/// An engine with its compiled components in the build folder.
pub(crate) fn engine() -> Engine {
    let cache = Some(target().join("test-cache"));
    Engine::new(EngineOptions { cache, ..EngineOptions::default() }).expect("an engine")
}

/// Reads a test file that stands in a folder of that name, with the components that were built.
pub(crate) fn check(engine: &Engine, path: &Path, text: &str) -> Checked {
    let folders = vec![target().join("components"), target().join("test-components")];
    for folder in &folders {
        assert!(folder.is_dir(), "{} is missing: run `cargo xtask guests` first", folder.display());
    }
    check_text(path, text.into(), engine, &Options { folders })
}

/// Runs the cases of a right test file.
#[allow(dead_code, reason = "not every test runs files")]
pub(crate) fn run(text: &str) -> Vec<CaseReport> {
    let engine = engine();
    let _ticker = Ticker::start(&engine, TICK);
    let checked = check(&engine, Path::new("x.test.toml"), text);
    let Some(file) = &checked.file else { panic!("{}", checked.render(false)) };
    file.cases.iter().map(|case| file.run(case, TICK.as_nanos() as u64)).collect()
}

/// The failures of a file as a person reads them, `fine` for a case without any.
#[allow(dead_code, reason = "not every test runs files")]
pub(crate) fn told(text: &str) -> String {
    let mut out = String::new();
    for case in run(text) {
        out += &format!("{}: {}\n", case.name, if case.passed { "fine" } else { "FAILED" });
        case.failures.iter().for_each(|f| out += &format!("{}\n", f.render(2)));
        if case.more_failures > 0 {
            out += &format!("  {} more\n", case.more_failures);
        }
    }
    out
}
