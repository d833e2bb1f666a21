//! Components in the build folder, built once for each state of their sources and tools.

use latchwork_author::Language;
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// The languages of this run: `LATCHWORK_LANGUAGES=c,zig` restricts it to some.
pub(crate) fn wanted(language: Language) -> bool {
    std::env::var("LATCHWORK_LANGUAGES").map_or(true, |c| c.split(',').any(|n| n == language.name()))
}

/// How a component came about.
pub(crate) struct Kept {
    /// What it imports.
    pub(crate) imports: Vec<String>,
    /// Processor time that the language's own tool took when it was built.
    pub(crate) took: Duration,
}

/// Files of a project that are no part of its component.
fn beside(file: &str) -> bool {
    file == "README.md" || file.ends_with(".test.toml")
}

/// Puts the component of a project into its folder: the one that was built of the same files by the same tools before, or that
/// which `build` makes; it gives what the component imports, or why it was not built.
///
/// `files` are those that `new` has written, below the folder, of which the last part is the block's name.
pub(crate) fn component<E>(
    target: &Path,
    language: Language,
    project: &Path,
    files: &[String],
    build: impl FnOnce() -> Result<Vec<String>, E>,
) -> Result<Kept, E> {
    let name = project.file_name().and_then(|n| n.to_str()).expect("the block's name");
    let shared = target.join("languages");
    let base = shared.join(language.name()).join("kept");
    std::fs::create_dir_all(&base).expect("a folder");
    let wasm = project.join(format!("{name}.wasm"));
    let kept = base.join(format!("{name}-{}", hash(language, project, files)));
    let (of, imports, facts) = (kept.join(format!("{name}.wasm")), kept.join("imports"), kept.join("took"));
    if let Some(took) = std::fs::read_to_string(&facts).ok().and_then(|t| t.parse().ok()) {
        std::fs::copy(&of, &wasm).expect("the component that was kept");
        let imports = std::fs::read_to_string(&imports).expect("what it imports");
        return Ok(Kept { imports: imports.lines().map(str::to_owned).collect(), took: Duration::from_millis(took) });
    }
    share(language, &shared, project);
    let start = time_of_tools();
    let made = build()?;
    let took = time_of_tools() - start;
    let _ = std::fs::remove_dir_all(&kept);
    std::fs::create_dir_all(&kept).expect("a folder");
    std::fs::copy(&wasm, &of).expect("the component is kept");
    std::fs::write(&imports, made.join("\n")).expect("the list is kept");
    // Last: with it the rest is whole.
    std::fs::write(&facts, took.as_millis().to_string()).expect("the time is kept");
    Ok(Kept { imports: made, took })
}

/// Of everything that goes into the component.
fn hash(language: Language, project: &Path, files: &[String]) -> String {
    let mut hash = Sha256::new();
    hash.update(tools(language));
    // What writes the glue, and makes the component of what a tool has built.
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut sources = Vec::new();
    collect(&own.join("src"), &mut sources);
    collect(&own.join("../sections/src"), &mut sources);
    for source in sources {
        hash.update(std::fs::read(source).expect("a source"));
    }
    let lock = std::fs::read_to_string(own.join("../../Cargo.lock")).expect("Cargo.lock");
    let encoder = lock.split("[[package]]").find(|p| p.starts_with("\nname = \"wit-component\"\n"));
    hash.update(encoder.expect("wit-component in Cargo.lock"));
    let mut files: Vec<&String> = files.iter().filter(|f| !beside(f)).collect();
    files.sort();
    for file in files {
        hash.update(file);
        hash.update(std::fs::read(project.join(file)).expect("a file"));
    }
    hex(hash.finalize().as_slice())
}

/// All files below a folder, in the order of their names.
fn collect(folder: &Path, into: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path());
    let mut entries: Vec<PathBuf> = entries.collect();
    entries.sort();
    for entry in entries {
        if entry.is_dir() {
            collect(&entry, into);
        } else {
            into.push(entry);
        }
    }
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
    // Not the first build of this project.
    if project.join(shared).symlink_metadata().is_ok() {
        return;
    }
    let list = std::fs::read_to_string(project.join("package.json")).unwrap_or_default();
    // The name of the project is the only thing that differs.
    let packages: String = list.lines().filter(|l| !l.contains("\"name\"")).collect();
    // One for JavaScript and TypeScript. Its last part keeps its name: Node finds a package's own packages by it.
    let place = base.join(format!("shared-{}", hex(Sha256::digest(packages).as_slice()))).join(shared);
    if shared == "node_modules" && !place.exists() {
        let draft = tempfile::tempdir_in(base).expect("a folder");
        std::fs::write(draft.path().join("package.json"), list).expect("the list of packages");
        let npm = Command::new("npm").args(["install", "--no-audit", "--no-fund"]).current_dir(draft.path()).status();
        if !npm.is_ok_and(|s| s.success()) {
            // The build tries it again, and says what is missing.
            return;
        }
        std::fs::create_dir_all(place.parent().expect("a folder")).expect("a folder");
        if let Err(e) = std::fs::rename(draft.path().join("node_modules"), &place) {
            // Another test was faster.
            assert!(place.exists(), "the packages cannot be moved: {e}");
        }
    }
    std::fs::create_dir_all(&place).expect("a folder");
    // The packages are those of the list, which is a moment younger.
    if let Ok(written) = std::fs::File::open(place.join(".package-lock.json")) {
        written.set_modified(std::time::SystemTime::now()).expect("the time can be set");
    }
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

/// Says that something was passed over, as all tests of this workspace do.
pub(crate) fn skip(why: &str) {
    assert!(std::env::var_os("LATCHWORK_SKIP").is_none_or(|s| s != "never"), "{why}");
    eprintln!("SKIPPED: {why}");
    // To cargo this test has passed; `cargo xtask test` counts it by this list.
    if let Some(list) = std::env::var_os("LATCHWORK_SKIPPED") {
        let file = std::fs::OpenOptions::new().create(true).append(true).open(list);
        let told = file.and_then(|mut f| writeln!(f, "{}", why.replace('\n', " ")));
        told.expect("the list of skipped tests can be written");
    }
}
