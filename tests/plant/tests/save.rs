//! `--save`: the plant file names what runs, and nothing else in it changes.

use latchwork_block::{Component, Engine};
use latchwork_plant::check::{CheckOptions, check_file};
use latchwork_plant::swap::save::{Keep, SaveError, Saver};
use latchwork_tests_plant::component_folders;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

/// Comments, an order of its own, odd blanks, both kinds of quotes, a name with dots, a sink.
const PLANT: &str = r#"# The stairs.
[plant]
name = 'stairs'   # as on the door
components = ["own", "shipped"]

[lane.main]
every = "10ms"
[driver.hall]
kind = "sim"
[driver.hall.points]
button = { type = "bool" }

[block.light]
lane      = "main"
component = 'ton'   # since the first day
inputs.in = "hall.button"

[block."zone-b.light"]
component="ton"
lane = "main"
inputs.in = "hall.button"
[sim.block.model]
component = "ton"
lane = "main"
inputs.in = "hall.button"
[sink.day]
component = "csv-days"
kind = "component"
directory = "logs"
# The end, without a line feed."#;

fn engine() -> &'static Engine {
    static ENGINE: OnceLock<Engine> = OnceLock::new();
    ENGINE.get_or_init(latchwork_tests_plant::engine)
}

fn shipped(name: &str) -> Vec<u8> {
    std::fs::read(component_folders()[0].join(format!("{name}.wasm"))).expect("a component")
}

/// A plant whose file can be saved.
struct Bench {
    folder: TempDir,
    saver: Saver,
}

impl Bench {
    fn new(text: &str) -> Self {
        let folder = TempDir::new().expect("a folder");
        std::fs::create_dir(folder.path().join("shipped")).expect("a folder");
        for name in ["ton", "csv-days"] {
            std::fs::write(folder.path().join(format!("shipped/{name}.wasm")), shipped(name)).expect("a file");
        }
        std::fs::write(folder.path().join("plant.toml"), text).expect("the plant file");
        let saver = saver(&folder.path().join("plant.toml"));
        Self { folder, saver }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn text(&self) -> String {
        std::fs::read_to_string(self.path("plant.toml")).expect("the plant file")
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), bytes).expect("a file");
    }

    fn save(&self, keep: &[Keep]) -> Result<Vec<String>, SaveError> {
        self.saver.save(engine(), keep)
    }

    /// Nothing is left of it: the plant file is as it was, and no folder has anything new.
    #[track_caller]
    fn refuses(&self, keep: &[Keep], expected: &str) {
        let (text, files) = (self.text(), self.files());
        let why = self.save(keep).expect_err("it is refused").to_string();
        assert!(why.contains(expected), "{why}");
        assert_eq!((self.text(), self.files()), (text, files), "{why}");
    }

    fn files(&self) -> Vec<String> {
        let list = |folder: PathBuf| std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut all: Vec<_> = [self.path(""), self.path("own"), self.path("shipped")]
            .into_iter()
            .flat_map(list)
            .filter(|e| e.path().is_file())
            .map(|e| e.path().display().to_string())
            .collect();
        all.sort_unstable();
        all
    }
}

fn saver(path: &Path) -> Saver {
    Saver::new(&model(path))
}

fn model(path: &Path) -> latchwork_plant::model::Model {
    let checked = check_file(path, engine(), CheckOptions { sim: true });
    let said = checked.render(false);
    checked.model.unwrap_or_else(|| panic!("{said}"))
}

fn keep(block: &str, file: &str, bytes: &[u8]) -> Keep {
    Keep { block: block.into(), file: file.into(), bytes: bytes.into(), settings: Vec::new() }
}

#[test]
fn only_the_names_of_the_components_change_and_all_of_a_swap_at_once() {
    let bench = Bench::new(PLANT);
    let (tof, csv) = (shipped("tof"), shipped("alarm-counter"));
    let all = [
        keep("zone-b.light", "slow.wasm", &tof),
        keep("light", "slow.wasm", &tof),
        keep("model", "slow.wasm", &tof),
        keep("sink.day", "counter.wasm", &csv),
    ];
    let said = bench.save(&all).expect("it is saved");
    assert_eq!(said[1], "light: component = \"slow\" in plant.toml");
    let expected = PLANT
        .replace("component = 'ton'   #", "component = \"slow\"   #")
        .replace("component=\"ton\"", "component=\"slow\"")
        .replace("component = \"ton\"\nlane", "component = \"slow\"\nlane")
        .replace("\"csv-days\"", "\"counter\"");
    assert_eq!(bench.text(), expected);
    // In the first of the folders, which was not there.
    assert_eq!(std::fs::read(bench.path("own/slow.wasm")).expect("a file"), tof);
    assert_eq!(std::fs::read(bench.path("own/counter.wasm")).expect("a file"), csv);
    assert_eq!(bench.files().len(), 5, "{:?}", bench.files());
    // What was saved is known: the next version goes over it, and the same one again changes nothing.
    bench.save(&all).expect("it is saved again");
    assert_eq!(bench.text(), expected);
    bench.save(&[keep("light", "ton.wasm", &shipped("ton"))]).expect("and back");
    assert_eq!(bench.text(), expected.replace("component = \"slow\"   #", "component = \"ton\"   #"));
    let said = check_file(&bench.path("plant.toml"), engine(), CheckOptions { sim: true });
    assert!(said.model.is_some(), "{}", said.render(false));
}

#[test]
fn lines_of_other_systems_stay_as_they_are() {
    let text = PLANT.replace('\n', "\r\n");
    let bench = Bench::new(&text);
    bench.save(&[keep("light", "slow.wasm", &shipped("tof"))]).expect("it is saved");
    assert_eq!(bench.text(), text.replace("'ton'", "\"slow\""));
}

#[test]
fn a_name_that_stands_for_other_bytes_in_any_folder_is_left_alone() {
    let bench = Bench::new(PLANT);
    let tof = shipped("tof");
    bench.save(&[keep("light", "ton.wasm", &tof)]).expect("it is saved");
    let name = format!("ton-{}", &Component::hash_of(&tof)[..8]);
    assert_eq!(bench.text(), PLANT.replace("'ton'", &format!("\"{name}\"")));
    assert_eq!(std::fs::read(bench.path("shipped/ton.wasm")).expect("a file"), shipped("ton"));
    assert!(!bench.path("own/ton.wasm").exists(), "it would take the place of the other one for zone-b.light");
    bench.write(&format!("own/{name}.wasm"), "something else");
    let (text, files) = (bench.text(), bench.files());
    let why = bench.save(&[keep("zone-b.light", "ton.wasm", &tof)]).expect_err("no name is left").to_string();
    assert!(why.contains("rename the file"), "{why}");
    assert_eq!((bench.text(), bench.files()), (text, files));
}

#[test]
fn without_folders_a_component_stands_beside_the_plant_file() {
    let text = PLANT
        .replace("components = [\"own\", \"shipped\"]\n", "")
        .replace("'ton'", "\"shipped/ton.wasm\"")
        .replace("\"ton\"", "\"shipped/ton.wasm\"")
        .replace("\"csv-days\"", "\"shipped/csv-days.wasm\"");
    let bench = Bench::new(&text);
    bench.save(&[keep("zone-b.light", "slow.wasm", &shipped("tof"))]).expect("it is saved");
    assert_eq!(bench.text(), text.replace("component=\"shipped/ton.wasm\"", "component=\"slow.wasm\""));
    assert!(bench.path("slow.wasm").is_file());
}

#[test]
fn what_others_have_edited_meanwhile_stays_and_what_is_not_known_is_not_written_over() {
    let bench = Bench::new(PLANT);
    let slow = |block| [keep(block, "slow.wasm", &shipped("tof"))];
    // Elsewhere: it stays.
    let elsewhere = PLANT.replace("\"10ms\"", "\"20ms\" # slower");
    bench.write("plant.toml", &elsewhere);
    bench.save(&slow("light")).expect("it is saved");
    assert_eq!(bench.text(), elsewhere.replace("'ton'", "\"slow\""));
    // The very name.
    bench.write("shipped/tp.wasm", shipped("tp"));
    bench.write("plant.toml", PLANT.replace("component=\"ton\"", "component=\"tp\""));
    bench.refuses(&slow("zone-b.light"), "`zone-b.light` has component \"tp\" in it, not \"ton\"");
    bench.write("plant.toml", PLANT.replace("\"zone-b.light\"", "\"zone-c.light\""));
    bench.refuses(&slow("zone-b.light"), "it has no component of `zone-b.light` any more");
    // One block of two: none.
    let both = [slow("model"), slow("zone-b.light")].concat();
    bench.refuses(&both, "no component of `zone-b.light`");
    bench.write("plant.toml", PLANT.replace("every = \"10ms\"", "every = "));
    bench.refuses(&slow("zone-b.light"), "edited since the plant was started");
    std::fs::remove_file(bench.path("plant.toml")).expect("a file");
    assert!(matches!(bench.save(&slow("model")), Err(SaveError::File { what: "read", .. })));
}

#[test]
fn nothing_is_saved_that_the_next_start_would_refuse() {
    let bench = Bench::new(PLANT);
    // Other ports than those that are wired.
    bench.refuses(&[keep("zone-b.light", "and.wasm", &shipped("ctu"))], "the plant file would have errors with it");
    bench.refuses(&[keep("zone-b.light", "text.wasm", b"no component")], "the plant file would have errors with it");
    for name in ["../x.wasm", ".wasm", "a\n.wasm", ""] {
        bench.refuses(&[keep("light", name, b"x")], "is no name for a component");
    }
}

#[test]
fn what_a_crash_has_left_is_in_nobodys_way() {
    let bench = Bench::new(PLANT);
    std::fs::create_dir(bench.path("own")).expect("a folder");
    bench.write(".plant.toml.saving", "half a pl");
    bench.write("own/.slow.wasm.saving", "half a comp");
    bench.save(&[keep("light", "slow.wasm", &shipped("tof"))]).expect("it is saved");
    assert_eq!(bench.text(), PLANT.replace("'ton'", "\"slow\""));
    assert!(!bench.path(".plant.toml.saving").exists() && !bench.path("own/.slow.wasm.saving").exists());
}

#[test]
fn a_link_stays_a_link_and_the_mode_is_kept() {
    let bench = Bench::new(PLANT);
    std::fs::set_permissions(bench.path("plant.toml"), std::fs::Permissions::from_mode(0o640)).expect("a mode");
    std::os::unix::fs::symlink("plant.toml", bench.path("link.toml")).expect("a link");
    let saver = saver(&bench.path("link.toml"));
    let before = std::fs::metadata(bench.path("plant.toml")).expect("a file");
    saver.save(engine(), &[keep("light", "slow.wasm", &shipped("tof"))]).expect("it is saved");
    assert!(std::fs::symlink_metadata(bench.path("link.toml")).expect("a link").is_symlink());
    let after = std::fs::metadata(bench.path("plant.toml")).expect("a file");
    assert_eq!((after.mode(), after.uid(), after.gid()), (before.mode(), before.uid(), before.gid()));
    assert_ne!(after.ino(), before.ino(), "it was replaced, not written over");
    assert_eq!(saver.named("light").as_deref(), Some("slow"));
}

#[test]
fn a_folder_that_cannot_be_written_changes_nothing() {
    let bench = Bench::new(PLANT);
    bench.write("own", "no folder");
    let text = bench.text();
    let why = bench.save(&[keep("light", "slow.wasm", &shipped("tof"))]).expect_err("it cannot").to_string();
    assert!(why.contains("own") && why.contains("cannot be"), "{why}");
    assert_eq!(bench.text(), text);
}

#[test]
fn what_would_keep_it_from_being_saved_is_known_beforehand_and_nothing_is_written() {
    let bench = Bench::new(PLANT);
    let slow = [keep("light", "slow.wasm", &shipped("tof"))];
    let tries = |keep: &[Keep], expected: Option<&str>| {
        let before = (bench.text(), bench.files());
        let tried = bench.saver.try_save(engine(), keep).map_err(|e| e.to_string());
        assert_eq!((bench.text(), bench.files()), before, "{tried:?}");
        match expected {
            Some(expected) => assert!(tried.as_ref().is_err_and(|why| why.contains(expected)), "{expected}: {tried:?}"),
            None => assert_eq!(tried, Ok(())),
        }
    };
    tries(&slow, None);
    assert!(!bench.path("own").exists(), "the folder would be made");
    tries(&[keep("light", "../x.wasm", b"x")], Some("is no name for a component"));
    tries(&[keep("dark", "slow.wasm", b"x")], Some("no component of `dark`"));
    bench.write("own", "no folder");
    tries(&slow, Some("own cannot be written"));
    std::fs::remove_file(bench.path("own")).expect("a file");
    bench.write("plant.toml", PLANT.replace("'ton'", "'tof'"));
    tries(&slow, Some("`light` has component \"tof\" in it, not \"ton\""));
    bench.write("plant.toml", PLANT.replace("\"hall.button\"", "\"hall.buton\""));
    tries(&slow, Some("the plant file would have errors"));
    bench.write("plant.toml", PLANT);
    // Root may write everywhere.
    if std::fs::metadata("/proc/self").expect("this process").uid() != 0 {
        let mode = |mode| {
            std::fs::set_permissions(bench.path(""), std::fs::Permissions::from_mode(mode)).expect("a mode");
        };
        mode(0o500);
        tries(&slow, Some("cannot be written"));
        mode(0o700);
    }
    std::fs::remove_file(bench.path("plant.toml")).expect("a file");
    assert!(matches!(bench.saver.try_save(engine(), &slow), Err(SaveError::File { what: "read", .. })));
    // A pipe, as the plant file of one that was started from another program's output.
    std::os::unix::fs::symlink("/dev/null", bench.path("plant.toml")).expect("a link");
    let why = bench.saver.try_save(engine(), &slow).expect_err("it is no file").to_string();
    assert!(why.contains("no file that could be written"), "{why}");
}

/// Blocks with a setting: in a table with a value, in one with another key, and in an inline table.
const SET: &str = r#"[plant]
name = "stairs"
components = ["own", "shipped"]
[lane.main]
every = "10ms"
[block.light]
component = "digital-veracity"
settings.time = "3s" # enough
lane = "main"
[block.door]
  component = "digital-veracity" # bounces
  lane = "main"
[block]
bell = { component = "digital-veracity", lane = "main" }
"#;

fn with_settings(block: &str, bytes: &[u8], settings: &[(&str, u64)]) -> Keep {
    let settings = settings.iter().map(|(name, cell)| ((*name).to_owned(), *cell)).collect();
    Keep { settings, ..keep(block, "slow.wasm", bytes) }
}

fn set() -> (Bench, Vec<u8>) {
    let bench = Bench::new(PLANT);
    let component = shipped("digital-veracity");
    bench.write("shipped/digital-veracity.wasm", &component);
    bench.write("plant.toml", SET);
    let saver = saver(&bench.path("plant.toml"));
    (Bench { saver, ..bench }, component)
}

#[test]
fn settings_that_run_and_that_the_file_would_not_give_are_written() {
    let (bench, component) = set();
    let all = [
        with_settings("light", &component, &[("time", 7_000_000_000)]),
        with_settings("door", &component, &[("time", 500_000_000)]),
    ];
    bench.save(&all).expect("it is saved");
    let expected = SET
        .replacen("\"digital-veracity\"", "\"slow\"", 2)
        .replace("\"3s\" # enough", "\"7s\" # enough")
        .replace("# bounces\n", "# bounces\n  settings.time = \"500ms\"\n");
    assert_eq!(bench.text(), expected);
}

#[test]
fn settings_that_it_starts_with_anyway_are_not_written() {
    let (bench, component) = set();
    bench.save(&[with_settings("door", &component, &[("time", 50_000_000)])]).expect("it is saved");
    assert_eq!(bench.text(), SET.replacen("\"digital-veracity\" # bounces", "\"slow\" # bounces", 1));
}

#[test]
fn a_setting_without_a_place_for_it_is_said_and_nothing_is_saved() {
    let (bench, component) = set();
    let keep = with_settings("bell", &component, &[("time", 1_000_000)]);
    bench.refuses(&[keep], "write `settings.time = \"1ms\"` into its table");
}

#[test]
fn a_disk_that_fails_after_the_plant_file_is_in_its_place_takes_no_component_away() {
    let mut bench = Bench::new(PLANT);
    // The folder of the components is brought to the disk, the plant file's is not.
    bench.saver = Saver::with_sync(&model(&bench.path("plant.toml")), |folder| match folder.ends_with("own") {
        true => Ok(()),
        false => Err(std::io::Error::other("the disk is gone")),
    });
    let said = bench.save(&[keep("light", "slow.wasm", &shipped("tof"))]).expect("it is saved");
    assert!(said.last().is_some_and(|s| s.contains("not known to be on the disk: the disk is gone")), "{said:?}");
    assert_eq!(bench.text(), PLANT.replace("'ton'", "\"slow\""));
    assert_eq!(bench.saver.named("light").as_deref(), Some("slow"));
    // The next start finds all that it names.
    model(&bench.path("plant.toml"));
    bench.save(&[keep("light", "ton.wasm", &shipped("ton"))]).expect("the next one knows of it");

    // Before that nothing is left.
    bench.write("plant.toml", PLANT);
    std::fs::remove_dir_all(bench.path("own")).expect("the folder");
    bench.saver =
        Saver::with_sync(&model(&bench.path("plant.toml")), |_| Err(std::io::Error::other("the disk is gone")));
    bench.refuses(&[keep("light", "slow.wasm", &shipped("tof"))], "the disk is gone");
}
