//! Projects in the build folder, built once for each state of their sources and tools.

use latchwork_author::{AuthorError, ClassChoice, Language, build, create};
use latchwork_block::{Engine, EngineOptions, Ticker};
use latchwork_testbed::case::{Options, check_file};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Period of the engine's ticks.
const TICK: Duration = Duration::from_millis(10);

/// A component, and how it came about.
pub(crate) struct Made {
    /// In a folder of its own, with the project's files.
    pub(crate) path: PathBuf,
    /// What it imports.
    pub(crate) imports: Vec<String>,
    /// Processor time that the language's own tool took when it was built.
    pub(crate) took: Duration,
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
    // One at a time: they share packages, and the machine has few cores.
    static ONE: Mutex<()> = Mutex::new(());
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let base = target().join("languages").join(language.name());
    std::fs::create_dir_all(&base).expect("a folder");
    let draft = tempfile::tempdir_in(&base).expect("a folder");
    let project = create(draft.path(), name, language, class).expect("a project");
    for (path, text) in sources {
        std::fs::write(project.folder.join(path), text).expect("a source");
    }
    let mut hash = Sha256::new();
    hash.update(tools(language));
    // What makes the component of what a tool has built.
    for part in [include_str!("../../src/component.rs"), include_str!("../../src/stub/wasi.wat")] {
        hash.update(part);
    }
    let mut files = project.files.clone();
    files.sort();
    // Neither the page nor the tests are part of the component.
    for file in files.iter().filter(|f| *f != "README.md" && !f.ends_with(".test.toml")) {
        hash.update(file);
        hash.update(std::fs::read(project.folder.join(file)).expect("a file"));
    }
    let hash = hex(hash.finalize().as_slice());
    let kept = base.join(format!("{name}-{hash}")).join(name);
    let facts = kept.with_file_name("took");
    if let Some(took) = std::fs::read_to_string(&facts).ok().and_then(|t| t.parse().ok()) {
        let imports = std::fs::read_to_string(kept.with_file_name("imports")).expect("what it imports");
        let imports = imports.lines().map(str::to_owned).collect();
        return Outcome::Built(Made {
            path: kept.join(format!("{name}.wasm")),
            imports,
            took: Duration::from_millis(took),
        });
    }
    share(language, &base, &project.folder);
    let start = time_of_tools();
    let result = build(&project.folder, &mut |command| eprintln!("{name}: {command}"));
    let made = match result {
        Ok(made) => made,
        Err(missing @ AuthorError::MissingTool { .. }) => return Outcome::Missing(missing.to_string()),
        Err(e) => panic!("{name} in {}: {e}", language.title()),
    };
    let took = time_of_tools() - start;
    let folder = kept.parent().expect("a folder");
    let _ = std::fs::remove_dir_all(folder);
    std::fs::create_dir_all(folder).expect("a folder");
    std::fs::rename(&project.folder, &kept).expect("the project is moved");
    std::fs::write(kept.with_file_name("imports"), made.imports.join("\n")).expect("the list is kept");
    // Last: with it the rest is whole.
    std::fs::write(&facts, took.as_millis().to_string()).expect("the time is kept");
    Outcome::Built(Made { path: kept.join(format!("{name}.wasm")), imports: made.imports, took })
}

/// Processor time of all processes that this one has waited for; the clock would count what else the machine does.
fn time_of_tools() -> Duration {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("Linux");
    // The second field, the program's name, may have spaces in it.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    // Fields 16 and 17 of proc(5), in ticks of 10 ms.
    let ticks = |field: usize| fields[field - 3].parse::<u64>().expect("a number");
    Duration::from_millis((ticks(16) + ticks(17)) * 10)
}

/// The first half of a hash, for the name of a folder.
fn hex(hash: &[u8]) -> String {
    hash.iter().take(8).map(|b| format!("{b:02x}")).collect()
}

/// What projects of a language need not fetch or build each for itself.
fn share(language: Language, base: &Path, project: &Path) {
    let shared = match language {
        Language::Rust => "target",
        Language::AssemblyScript | Language::JavaScript | Language::TypeScript => "node_modules",
        _ => return,
    };
    let list = std::fs::read_to_string(project.join("package.json")).unwrap_or_default();
    // The name of the project is the only thing that differs.
    let packages: String = list.lines().filter(|l| !l.contains("\"name\"")).collect();
    // One for JavaScript and TypeScript. Its last part keeps its name: Node finds a package's own packages by it.
    let place = base.with_file_name(format!("shared-{}", hex(Sha256::digest(packages).as_slice()))).join(shared);
    if shared == "node_modules" && !place.exists() {
        let draft = tempfile::tempdir_in(base).expect("a folder");
        std::fs::write(draft.path().join("package.json"), list).expect("the list of packages");
        let npm = Command::new("npm").args(["install", "--no-audit", "--no-fund"]).current_dir(draft.path()).status();
        if !npm.is_ok_and(|s| s.success()) {
            // The build tries it again, and says what is missing.
            return;
        }
        std::fs::create_dir_all(place.parent().expect("a folder")).expect("a folder");
        std::fs::rename(draft.path().join("node_modules"), &place).expect("the packages are moved");
    }
    std::fs::create_dir_all(&place).expect("a folder");
    std::os::unix::fs::symlink(&place, project.join(shared)).expect("a link");
}

/// What the tools of a language say of themselves.
fn tools(language: Language) -> Vec<u8> {
    let commands: &[&[&str]] = match language {
        Language::Rust => &[&["rustc", "--version"]],
        Language::C | Language::Cpp => &[&["clang-19", "--version"]],
        Language::Zig => &[&["zig", "version"], &["python-zig", "version"]],
        Language::Go => &[&["go", "version"]],
        Language::Python => &[&["componentize-py", "--version"]],
        Language::AssemblyScript | Language::JavaScript | Language::TypeScript => &[&["node", "--version"]],
    };
    let said = commands.iter().filter_map(|c| Command::new(c[0]).args(&c[1..]).output().ok());
    said.flat_map(|o| o.stdout).collect()
}

/// Runs a test file on the component of a folder.
pub(crate) fn run_tests(file: &Path, folder: &Path) {
    let engine = engine();
    let _ticker = Ticker::start(&engine, TICK);
    let mut checked = check_file(file, &engine, &Options { folders: vec![folder.to_path_buf()] });
    let shown = checked.render(false);
    let Some(tests) = &mut checked.file else { panic!("{}: {shown}", folder.display()) };
    // Interpreters bring their own heap.
    tests.memory = 256 << 20;
    tests.budget = 10_000_000_000;
    assert!(!tests.cases.is_empty(), "{} has no case", file.display());
    for case in &tests.cases {
        let report = tests.run(case, TICK.as_nanos() as u64);
        let failures: String = report.failures.iter().map(|f| f.render(2)).collect();
        assert!(report.passed, "{}: {}\n{failures}", folder.display(), report.name);
    }
}

/// Says that something was passed over, as all tests of this workspace do.
pub(crate) fn skip(why: &str) {
    assert!(std::env::var_os("LATCHWORK_SKIP").is_none_or(|s| s != "never"), "{why}");
    eprintln!("SKIPPED: {why}");
}
