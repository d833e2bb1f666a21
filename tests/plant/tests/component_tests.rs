//! Every test file of the project's blocks and example plants passes, and the families that have them have one for each block.

use latchwork_block::Ticker;
use latchwork_plantbed::check_file;
use latchwork_testbed::case::Options;
use latchwork_tests_plant::{component_folders, engine, target};
use std::path::{Path, PathBuf};
use std::time::Duration;

const TICK: Duration = Duration::from_millis(10);

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The test files below a folder.
fn files(folder: &Path, list: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path()) {
        if entry.is_dir() {
            files(&entry, list);
        } else if entry.to_string_lossy().ends_with(".test.toml") {
            list.push(entry);
        }
    }
}

/// Runs all test files below a folder; the number of cases.
fn run(folder: &str) -> usize {
    let engine = engine();
    let _ticker = Ticker::start(&engine, TICK);
    let mut folders = component_folders();
    folders.push(target().join("example-components"));
    let (mut list, mut cases, mut wrong) = (Vec::new(), 0, String::new());
    files(&root().join(folder), &mut list);
    for path in list {
        // The block in C wants a compiler that not every machine has.
        let in_c = path.ends_with("pump-hours-c.test.toml")
            && !target().join("example-components/pump-hours-c.wasm").is_file();
        if in_c && std::env::var_os("LATCHWORK_SKIP").is_none_or(|s| s != "never") {
            println!(
                "{} is passed over: `cargo xtask guests` builds its block where clang-19 and lld-19 are",
                path.display()
            );
            continue;
        }
        let checked = check_file(&path, &engine, &Options { folders: folders.clone() });
        let Some(tests) = &checked.tests else {
            wrong += &checked.render(false);
            continue;
        };
        for case in 0..tests.cases().len() {
            let report = tests.run(case, TICK.as_nanos() as u64);
            cases += 1;
            for failure in &report.failures {
                wrong += &format!("{}: {}\n{}", path.display(), report.name, failure.render(2));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{wrong}");
    cases
}

#[test]
fn the_tests_of_the_shipped_blocks_pass() {
    assert!(run("components") > 100);
}

#[test]
fn the_tests_of_the_examples_blocks_pass() {
    assert!(run("examples/hot-swap") >= 11);
}

#[test]
fn the_tests_of_the_examples_plants_pass() {
    for (plant, cases) in [("alarm-unit", 6), ("fast-interlock", 5)] {
        assert!(run(&format!("examples/{plant}")) >= cases, "{plant}");
    }
}

/// A plant that comes as an example comes with its test.
#[test]
fn every_example_plant_has_its_tests() {
    for folder in std::fs::read_dir(root().join("examples")).expect("the examples") {
        let folder = folder.expect("an example").path();
        if folder.join("plant.toml").is_file() {
            let file = folder.join("plant.test.toml");
            assert!(file.is_file(), "{} is missing", file.display());
        }
    }
}

#[test]
fn every_block_of_the_alarm_and_iec_families_has_its_tests() {
    for family in ["alarm", "iec"] {
        for block in std::fs::read_dir(root().join("components").join(family)).expect("a family") {
            let folder = block.expect("a block").path();
            let name = folder.file_name().expect("a name").to_string_lossy().into_owned();
            let file = folder.join(format!("{name}.test.toml"));
            assert!(file.is_file(), "{} is missing", file.display());
        }
    }
}
