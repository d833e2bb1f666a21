//! Projects that `new` writes, with other sources, built and tested.

use crate::kept;
use latchwork_author::{AuthorError, ClassChoice, Language, build, create};
use latchwork_block::{Engine, EngineOptions, Ticker};
use latchwork_testbed::case::{Options, Subject, check_file};
use latchwork_testbed::fuzz;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Period of the engine's ticks.
const TICK: Duration = Duration::from_millis(10);

/// A component, and how it came about.
pub(crate) struct Made {
    /// In the project's folder.
    pub(crate) path: PathBuf,
    /// What it imports.
    pub(crate) imports: Vec<String>,
    /// Processor time that the language's own tool took when it was built.
    pub(crate) took: Duration,
    /// Where the project is.
    _parent: TempDir,
}

/// What became of a project.
pub(crate) enum Outcome {
    /// It is there.
    Built(Made),
    /// A tool is not.
    Missing(String),
}

/// The repository.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn target() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder").to_path_buf()
}

/// An engine that compiles no component twice.
pub(crate) fn engine() -> Engine {
    let cache = Some(target().join("test-cache"));
    Engine::new(EngineOptions { cache, ..EngineOptions::default() }).expect("an engine")
}

/// Writes a project, puts `sources` over it, and builds it unless that was done before.
pub(crate) fn built(language: Language, name: &str, class: &ClassChoice, sources: &[(String, String)]) -> Outcome {
    attempt(language, name, class, sources).unwrap_or_else(|e| panic!("{name} in {}: {e}", language.title()))
}

/// The same, where the build may be refused.
pub(crate) fn attempt(
    language: Language,
    name: &str,
    class: &ClassChoice,
    sources: &[(String, String)],
) -> Result<Outcome, AuthorError> {
    // One at a time: they share packages, and the machine has few cores.
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    // Packages are linked from the build folder, and Node finds them by where a project really is.
    let parent = tempfile::tempdir_in(target()).expect("a folder");
    let project = create(parent.path(), name, language, class).expect("a project");
    for (path, text) in sources {
        std::fs::write(project.folder.join(path), text).expect("a source");
    }
    let made = kept::component(&target(), language, &project.folder, &project.files, || {
        build(&project.folder, &mut |command| eprintln!("{name}: {command}")).map(|built| built.imports)
    });
    match made {
        Ok(kept::Kept { imports, took }) => {
            let path = project.folder.join(format!("{name}.wasm"));
            Ok(Outcome::Built(Made { path, imports, took, _parent: parent }))
        }
        Err(missing @ AuthorError::MissingTool { .. }) => Ok(Outcome::Missing(missing.to_string())),
        Err(e) => Err(e),
    }
}

/// Runs a test file on the component of a folder; `memory` if it is to have more than the file says.
pub(crate) fn run_tests(file: &Path, folder: &Path, memory: Option<u64>) {
    let engine = engine();
    let _ticker = Ticker::start(&engine, TICK);
    let mut checked = check_file(file, &engine, &Options { folders: vec![folder.to_path_buf()] });
    let shown = checked.render(false);
    let Some(tests) = &mut checked.file else { panic!("{}: {shown}", folder.display()) };
    tests.memory = memory.unwrap_or(tests.memory);
    // A busy machine is not what is tested here.
    tests.budget = 10_000_000_000;
    assert!(!tests.cases.is_empty(), "{} has no case", file.display());
    for case in &tests.cases {
        let report = tests.run(case, TICK.as_nanos() as u64);
        let failures: String = report.failures.iter().map(|f| f.render(2)).collect();
        assert!(report.passed, "{}: {}\n{failures}", folder.display(), report.name);
    }
}

/// Fuzzes the component for `sequences`, always the same; it finds nothing but what is meant to be so.
pub(crate) fn fuzz(path: &Path, sequences: u64, meant: &[fuzz::Kind]) {
    let engine = engine();
    let _ticker = Ticker::start(&engine, TICK);
    let component = engine.load_file(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let class = component.class(None).expect("one class");
    let template = component.template(&class).expect("a template");
    let subject = Subject { component, class, template };
    let options = fuzz::Options {
        seed: 1,
        sequences: Some(sequences),
        // What a busy machine does not miss three times in the same place, and what interpreters need.
        budget: 100_000_000,
        memory: 64 << 20,
        tick: TICK.as_nanos() as u64,
        ignored: meant.to_vec(),
        ..fuzz::Options::default()
    };
    let begun = Instant::now();
    let clock = || begun.elapsed().as_nanos() as u64;
    let report = fuzz::fuzz(&subject, &options, &clock, &mut |_| {});
    assert!(report.findings.is_empty(), "{}: {:#?}", path.display(), report.findings);
    assert_eq!(report.sequences, sequences, "{}", path.display());
}
