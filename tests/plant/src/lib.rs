//! What tests of whole plants share: a plant file as text, run at virtual time, with everything it did.
//!
//! The components are those that `cargo xtask guests` made; without them the tests fail and say so.

pub mod forge;
mod log;
mod running;
pub mod soak;

pub use log::{Log, Told};
pub use running::Running;

use latchwork_block::{Engine, EngineOptions};
use latchwork_image::TagId;
use latchwork_plant::assemble::{Options, Plant, Time, assemble};
use latchwork_plant::check::{CheckOptions, check_file};
use latchwork_plant::run::{Outcome, RunOptions, resolve_stimulus, run_virtual};
use latchwork_record::{Kind, Record};
use latchwork_retain::{Figures, Found, Memory, Retained, Vault};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use tempfile::TempDir;

/// The build folder this test was built in.
///
/// # Panics
/// If the test's program does not stand in one.
pub fn target() -> PathBuf {
    let exe = std::env::current_exe().expect("this program has a path");
    // target/release/deps/TEST
    exe.ancestors().nth(3).expect("a test stands three folders below the build folder").to_path_buf()
}

/// The folders with the components that ship and those that only tests use.
///
/// # Panics
/// If the guests have not been built.
pub fn component_folders() -> Vec<PathBuf> {
    let folders = vec![target().join("components"), target().join("test-components")];
    for folder in &folders {
        assert!(folder.is_dir(), "{} is missing: run `cargo xtask guests` first", folder.display());
    }
    folders
}

/// An engine with its compiled components in the build folder.
///
/// # Panics
/// If it does not start.
pub fn engine() -> Engine {
    let cache = Some(target().join("test-cache"));
    Engine::new(EngineOptions { cache, ..EngineOptions::default() }).expect("an engine")
}

/// A plant under test.
pub struct Rig {
    folder: TempDir,
    engine: Engine,
    sim: bool,
    stimulus: String,
    trace: Option<String>,
    kept: BTreeMap<String, String>,
    retained: Found,
}

/// All that a run did.
pub struct Ran {
    /// What the run left to be kept, as the journal would have it.
    pub kept: BTreeMap<String, String>,
    /// What was to be written of retained state, one after the other.
    pub saves: Vec<Retained>,
    /// Figures of that.
    pub figures: Figures,
    /// Outcome.
    pub outcome: Outcome,
    /// Records.
    pub records: Vec<Record>,
    /// Rows of the trace: time in ns, tag, value as text.
    pub trace: Vec<(u64, String, String)>,
}

impl Rig {
    /// A plant from the text of its file; `components` in `[plant]` is filled in.
    ///
    /// # Panics
    /// If a temporary folder cannot be made.
    pub fn new(text: &str) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let list: Vec<_> = component_folders().iter().map(|f| format!("{:?}", f.display().to_string())).collect();
        let head = format!("[plant]\nname = \"test\"\ncomponents = [{}]\n", list.join(", "));
        std::fs::write(folder.path().join("plant.toml"), format!("{head}{text}")).expect("the plant file");
        Self {
            folder,
            engine: engine(),
            sim: false,
            stimulus: String::new(),
            trace: Some("*".into()),
            kept: BTreeMap::new(),
            retained: Found::default(),
        }
    }

    /// With `--sim`.
    pub fn sim(mut self) -> Self {
        self.sim = true;
        self
    }

    /// With a component in the folder of its plant file, where `component = "NAME.wasm"` and stimulus rows find it.
    ///
    /// # Panics
    /// If it cannot be written.
    pub fn with(self, name: &str, component: &[u8]) -> Self {
        std::fs::write(self.folder.path().join(format!("{name}.wasm")), component).expect("a component");
        self
    }

    /// With rows `time,tag,value`.
    pub fn stimulus(mut self, rows: &str) -> Self {
        self.stimulus = format!("time,tag,value\n{rows}");
        self
    }

    /// After an earlier run that left this.
    pub fn after(mut self, kept: &BTreeMap<String, String>) -> Self {
        self.kept.clone_from(kept);
        self
    }

    /// After an earlier run that left this retained state.
    pub fn retained(mut self, found: Found) -> Self {
        self.retained = found;
        self
    }

    /// Tracing other tags than all.
    pub fn trace(mut self, glob: Option<&str>) -> Self {
        self.trace = glob.map(str::to_string);
        self
    }

    /// The plant file.
    pub fn path(&self) -> PathBuf {
        self.folder.path().join("plant.toml")
    }

    /// The plant, assembled.
    ///
    /// # Panics
    /// With its errors, if the file is wrong.
    pub fn plant(&self, time: Time) -> Plant {
        assemble_file(&self.path(), &self.engine, self.sim, time, self.trace.as_deref())
    }

    /// Runs it for some plant time, ns.
    ///
    /// # Panics
    /// If the stimulus does not fit.
    pub fn run_for(&self, duration: u64) -> Ran {
        self.run(RunOptions { duration: Some(duration), ..RunOptions::default() })
    }

    /// Runs it.
    ///
    /// # Panics
    /// If the stimulus does not fit.
    pub fn run(&self, mut options: RunOptions) -> Ran {
        let mut plant = self.plant(Time::Virtual);
        plant.restore(&self.kept);
        let vault = Memory::default();
        plant.retain(&self.retained, Box::new(vault.clone()));
        if !self.stimulus.is_empty() {
            let rows = latchwork_io::stimulus::read(self.stimulus.as_bytes()).expect("a right stimulus");
            options.stimulus = resolve_stimulus(&plant, &rows).expect("a stimulus that fits");
        }
        let types: HashMap<TagId, _> =
            plant.layout.tags.iter().map(|(id, t)| (id, (t.name.clone(), t.ty.clone()))).collect();
        let mut log = Log { kept: self.kept.clone(), ..Log::default() };
        let outcome = run_virtual(plant, &options, &AtomicBool::new(false), &mut log);
        let row = |c: &latchwork_plant::lane::Change| {
            let (name, ty) = &types[&c.tag];
            (c.time, name.clone(), ty.format(c.cell))
        };
        let trace = log.changes.iter().map(row).collect();
        let (saves, figures) = (vault.all(), vault.figures());
        Ran { outcome, trace, records: log.records, kept: log.kept, saves, figures }
    }
}

/// Checks and assembles a plant file.
///
/// # Panics
/// With its errors, if the file is wrong.
pub fn assemble_file(path: &Path, engine: &Engine, sim: bool, time: Time, trace: Option<&str>) -> Plant {
    let checked = check_file(path, engine, CheckOptions { sim });
    let Some(model) = checked.model else { panic!("{}", checked.render(false)) };
    assemble(model, engine, &Options { time, trace }).unwrap_or_else(|e| panic!("{e}"))
}

impl Ran {
    /// The retained state that the run has left, as the next one finds it.
    ///
    /// # Panics
    /// If it has left none.
    pub fn left(&self) -> Found {
        Found::of(self.saves.last().expect("a retained state").clone())
    }

    /// Every value a tag had, with the time of each, ns.
    pub fn history(&self, tag: &str) -> Vec<(u64, &str)> {
        self.trace.iter().filter(|(_, t, _)| t == tag).map(|(time, _, v)| (*time, v.as_str())).collect()
    }

    /// The value of a tag at a plant time, ns: at the end of the last scan that is not later.
    ///
    /// # Panics
    /// If the tag was not traced before.
    pub fn at(&self, tag: &str, time: u64) -> &str {
        let before = self.trace.iter().rfind(|(t, name, _)| *t <= time && name == tag);
        &before.unwrap_or_else(|| panic!("no value of {tag} at {time} ns")).2
    }

    /// Records of one kind as `time source transition`, time in ms.
    pub fn told(&self, kind: Kind) -> Vec<String> {
        let of_kind = self.records.iter().filter(|r| r.kind == kind);
        of_kind.map(|r| format!("{} ms {} {}", r.time / 1_000_000, r.source, r.transition)).collect()
    }
}
