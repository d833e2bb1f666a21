//! Killed before each system call of a save, and in the middle of each writing: what is there afterwards is the old or the new,
//! whole. Writers that do it wrong on purpose are found out, so that these tests are known to see it.

mod tracer;

use latchwork_block::Engine;
use latchwork_plant::check::{CheckOptions, check_file};
use latchwork_plant::swap::save::{Keep, Saver};
use latchwork_retain::{FILES, Retained, Saved, Store, Version, encode, read};
use latchwork_tests_plant::{component_folders, engine};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tempfile::TempDir;
use tracer::{Cut, run, trace_me};

/// Tell the child what to do, and where.
const WRITER: &str = "LATCHWORK_CUT_WRITER";
const FOLDER: &str = "LATCHWORK_CUT_FOLDER";
const LIMIT: Duration = Duration::from_secs(30);

const PLANT: &str = "[plant]\nname = \"stairs\"\ncomponents = [\"own\", \"shipped\"]\n[lane.main]\nevery = \"10ms\"\n\
                     [block.light]\ncomponent = \"ton\"\nlane = \"main\"\n";

/// What is written, and by whom.
#[derive(Clone, Copy, Debug)]
enum Writer {
    /// The plant file with its component, as `--save` does it.
    Save,
    /// The plant file, where it stands: wrong.
    SaveInPlace,
    /// The plant file before the component that it names: wrong.
    SavePlantFileFirst,
    /// Retained states, as a plant does it.
    Retain,
    /// Retained states over those that were written last: wrong.
    RetainSingle,
    /// Retained states, and the older ones are removed before: wrong, as the newest may be what a disk has lost.
    RetainCutsFirst,
}

const WRITERS: [Writer; 6] = [
    Writer::Save,
    Writer::SaveInPlace,
    Writer::SavePlantFileFirst,
    Writer::Retain,
    Writer::RetainSingle,
    Writer::RetainCutsFirst,
];

/// Which of the two is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Old,
    New,
}

fn shipped(name: &str) -> Vec<u8> {
    std::fs::read(component_folders()[0].join(format!("{name}.wasm"))).expect("a component")
}

/// States that take more than one block of a disk. Those of any one digit are as long: half of one and half of another one
/// make sense, but for the checksum.
fn states(seed: u64) -> Retained {
    let (class, component, schema) = ("test:a/b@1.0.0".into(), "b".into(), "n:u64".into());
    let version = Arc::new(Version { class, component, hash: "ab".repeat(32), schema });
    let saved = Arc::new(Saved { version, time: seed, wall: seed, cells: [seed].into() });
    Retained { blocks: (0..200).map(|n| (format!("b{n}"), Arc::clone(&saved))).collect() }
}

fn keep_states(folder: &Path, states: Retained) {
    let (store, _) = Store::open(folder).expect("a store");
    store.vault().keep(Some(states), true);
    store.close(LIMIT).expect("durable");
}

fn saver(plant: &Path, engine: &Engine) -> Saver {
    let checked = check_file(plant, engine, CheckOptions::default());
    let said = checked.render(false);
    Saver::new(&checked.model.unwrap_or_else(|| panic!("{said}")))
}

fn saves(saver: &Saver, engine: &Engine) {
    let keep =
        Keep { block: "light".into(), file: "slow.wasm".into(), bytes: shipped("tof").into(), settings: Vec::new() };
    saver.save(engine, &[keep]).expect("it is saved");
}

fn new_plant() -> String {
    PLANT.replace("\"ton\"", "\"slow\"")
}

impl Writer {
    fn of_plant(self) -> bool {
        matches!(self, Self::Save | Self::SaveInPlace | Self::SavePlantFileFirst)
    }

    /// What is there before.
    fn prepare(self, folder: &Path) {
        if self.of_plant() {
            std::fs::create_dir(folder.join("shipped")).expect("a folder");
            std::fs::write(folder.join("shipped/ton.wasm"), shipped("ton")).expect("a component");
            std::fs::write(folder.join("plant.toml"), PLANT).expect("the plant file");
        } else {
            // The newest ones are in file 1, so that file 0 is next.
            keep_states(folder, states(1));
            keep_states(folder, states(2));
        }
    }

    /// The child's work; it is traced from where the writing begins.
    fn write(self, folder: &Path) {
        match self {
            Self::Save => {
                let engine = engine();
                let saver = saver(&folder.join("plant.toml"), &engine);
                trace_me();
                saves(&saver, &engine);
            }
            Self::SaveInPlace => {
                trace_me();
                std::fs::create_dir(folder.join("own")).expect("a folder");
                std::fs::write(folder.join("own/slow.wasm"), shipped("tof")).expect("written");
                std::fs::write(folder.join("plant.toml"), new_plant()).expect("written");
            }
            Self::SavePlantFileFirst => {
                trace_me();
                let place = |bytes: &[u8], name: &str| {
                    std::fs::write(folder.join("beside"), bytes).expect("written");
                    std::fs::rename(folder.join("beside"), folder.join(name)).expect("renamed");
                };
                place(new_plant().as_bytes(), "plant.toml");
                std::fs::create_dir(folder.join("own")).expect("a folder");
                place(&shipped("tof"), "own/slow.wasm");
            }
            Self::Retain => {
                trace_me();
                keep_states(folder, states(3));
            }
            Self::RetainSingle => {
                let bytes = encode(3, &states(3)).expect("it fits");
                trace_me();
                use std::os::unix::fs::FileExt;
                let file = std::fs::File::options().write(true).open(folder.join(FILES[1])).expect("a file");
                file.write_all_at(&bytes, 0).expect("written");
            }
            Self::RetainCutsFirst => {
                let bytes = encode(3, &states(3)).expect("it fits");
                trace_me();
                std::fs::remove_file(folder.join(FILES[1])).expect("removed");
                std::fs::write(folder.join(FILES[0]), bytes).expect("written");
            }
        }
    }

    /// What is there after; why it is neither the old nor the new.
    fn look(self, folder: &Path) -> Result<State, String> {
        if !self.of_plant() {
            let found = read(folder);
            return match found.retained {
                old if old == states(2) => Ok(State::Old),
                new if new == states(3) => Ok(State::New),
                _ => Err(format!("generation {} of {:?}", found.generation, found.damage)),
            };
        }
        let component = std::fs::read(folder.join("own/slow.wasm")).ok();
        if component.as_ref().is_some_and(|bytes| *bytes != shipped("tof")) {
            return Err("half of a component".into());
        }
        match std::fs::read_to_string(folder.join("plant.toml")).map_err(|e| e.to_string())? {
            old if old == PLANT => Ok(State::Old),
            new if new == new_plant() && component.is_some() => Ok(State::New),
            other => Err(format!("component {}, plant file {other:?}", component.is_some())),
        }
    }

    /// The next one comes to its end, whatever was left behind.
    fn again(self, folder: &Path) {
        if self.of_plant() {
            let engine = engine();
            saves(&saver(&folder.join("plant.toml"), &engine), &engine);
            assert_eq!(self.look(folder), Ok(State::New));
            assert!(!folder.join(".plant.toml.saving").exists());
        } else {
            keep_states(folder, states(3));
            assert_eq!(self.look(folder), Ok(State::New));
        }
    }
}

/// Not a test by itself: the one that is killed.
#[test]
#[ignore = "the other tests start it"]
fn child() {
    let (Some(name), Some(folder)) = (std::env::var_os(WRITER), std::env::var_os(FOLDER)) else { return };
    let writer = WRITERS.into_iter().find(|w| *format!("{w:?}") == *name).expect("a writer");
    writer.write(Path::new(&folder));
    // Whatever else this program does at its end is nobody's business.
    std::process::exit(0);
}

/// A run with this cut: the calls that it has made, whether it came to the cut, and what is there then.
type Ran = (Vec<String>, bool, Result<State, String>);

/// `None` where programs may not be traced.
fn one(writer: Writer, cut: Option<Cut>) -> Option<(TempDir, Ran)> {
    let folder = TempDir::new().expect("a temporary folder");
    let path = folder.path().canonicalize().expect("it is there");
    writer.prepare(&path);
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command.args(["--exact", "child", "--ignored", "--test-threads=1"]);
    command.env(WRITER, format!("{writer:?}")).env(FOLDER, &path).stdout(Stdio::null()).stderr(Stdio::null());
    let done = run(&mut command, &path, cut).unwrap_or_else(|e| panic!("{writer:?}, {cut:?}: {e}"))?;
    let state = writer.look(&path);
    Some((folder, (done.calls.into_iter().map(|c| c.text).collect(), done.cut, state)))
}

/// Passes a test over that this machine lacks something for; where everything must be there it fails.
fn skipped(why: &str) {
    assert!(std::env::var_os("LATCHWORK_SKIP").is_none_or(|s| s != "never"), "{why}");
    eprintln!("SKIPPED {why}");
    if let Some(list) = std::env::var_os("LATCHWORK_SKIPPED") {
        let file = std::fs::OpenOptions::new().append(true).open(list);
        file.and_then(|mut f| writeln!(f, "{why}")).expect("the list of skipped tests");
    }
}

/// A cut, and what is there after it.
type Found = (Cut, Result<State, String>);

/// The calls of a run without a cut, and every cut of the writer, one after the other.
fn all(writer: Writer) -> Option<(Vec<String>, Vec<Found>)> {
    // A program that is being started holds for a moment what this one has open, and with it the lock of another test's files.
    static ALONE: Mutex<()> = Mutex::new(());
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some((_folder, (calls, cut, state))) = one(writer, None) else {
        skipped("saves cut off at each system call: no program may be traced here");
        return None;
    };
    assert!(!cut && state == Ok(State::New), "{calls:?}: {state:?}");
    let mut found = Vec::new();
    for (n, call) in calls.iter().enumerate() {
        let within = call.starts_with("write").then_some(Cut::Within(n));
        for cut in [Cut::Before(n)].into_iter().chain(within) {
            let (folder, (there, came, state)) = one(writer, Some(cut))?;
            // What is left of a writing is tried once more.
            assert!(came && there.starts_with(&calls[..=n]), "{cut:?} of {calls:?}: {there:?}");
            if state.is_ok() {
                writer.again(folder.path());
            }
            found.push((cut, state));
        }
    }
    Some((calls, found))
}

/// All cuts leave the old, then all of them the new.
#[track_caller]
fn old_then_new(calls: &[String], found: &[Found]) {
    let states: Vec<_> = found.iter().map(|(_, state)| state.clone()).collect();
    let olds = states.iter().take_while(|s| **s == Ok(State::Old)).count();
    assert!(states[olds..].iter().all(|s| *s == Ok(State::New)), "{calls:#?}: {found:#?}");
    assert!(olds > 0 && olds < states.len(), "{calls:#?}: {found:#?}");
}

#[test]
fn a_save_that_is_cut_off_anywhere_leaves_the_old_plant_file_or_the_new_one_with_all_it_names() {
    let Some((calls, found)) = all(Writer::Save) else { return };
    old_then_new(&calls, &found);
    // What makes it hold for a power cut, too: nothing gets its name before it is on the disk, the plant file comes last, and
    // each folder is on the disk before anything counts on what it names.
    let component = ["open own/.slow.wasm.saving", "write own/.slow.wasm.saving", "sync own/.slow.wasm.saving"];
    let plant = ["open .plant.toml.saving", "write .plant.toml.saving", "sync .plant.toml.saving"];
    let named = [["rename own/slow.wasm", "sync own"], ["rename plant.toml", "sync"]];
    let wanted = [&component[..], &named[0], &plant, &named[1]].concat();
    let told: Vec<_> = calls.iter().map(String::as_str).filter(|c| !c.starts_with("remove ")).collect();
    assert_eq!(told, [&["make own"][..], &wanted].concat());
}

#[test]
fn retained_states_whose_writing_is_cut_off_anywhere_are_the_last_or_the_last_but_one() {
    let Some((calls, found)) = all(Writer::Retain) else { return };
    old_then_new(&calls, &found);
    let writes: Vec<_> = calls.iter().filter(|c| !c.starts_with("open ")).map(String::as_str).collect();
    assert_eq!(writes, ["sync", "write retained-0", "sync retained-0"]);
}

#[test]
fn writers_that_do_it_wrong_are_found_out() {
    for wrong in [Writer::SaveInPlace, Writer::SavePlantFileFirst, Writer::RetainSingle, Writer::RetainCutsFirst] {
        let Some((calls, found)) = all(wrong) else { return };
        let halves: Vec<_> = found.iter().filter(|(_, state)| state.is_err()).collect();
        assert!(!halves.is_empty(), "{wrong:?} was not found out: {calls:#?}: {found:#?}");
    }
}
