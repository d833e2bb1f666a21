//! The cache of compiled code: faster when it is good, and never executed when it is not.
//!
//! The folder is treated as an attacker or a dying disk would: no test knows its format.

mod support;

use latchwork_block::{CallPath, Engine, EngineOptions, Limits, Scan};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use support::class::{Leaf, Spec, Ty};
use support::component::generated;
use support::evil::{Evil, When};
use support::model::Model;
use support::strategy::{self, Cells};
use support::twins::first_scan;

/// Three classes that answer differently.
fn spec(n: usize) -> Spec {
    Spec {
        inputs: vec![Ty::RealSignal; n + 1],
        outputs: vec![Ty::Leaf(Leaf::U64), Ty::Leaf(Leaf::U32)],
        alarms: 7,
        ..Spec::default()
    }
}

fn engine(cache: &Path, path: Option<CallPath>) -> Engine {
    Engine::new(EngineOptions { cache: Some(cache.into()), force_path: path }).unwrap()
}

/// Loads a component by an engine of its own, as another process would, and checks its answers against the model.
fn right(cache: &Path, n: usize) {
    for path in [CallPath::Component, CallPath::Plain] {
        let spec = spec(n);
        let component = engine(cache, Some(path)).load_bytes("case", &generated(&spec, Evil::None, When(0))).unwrap();
        let template = component.template(&component.class(None).unwrap()).unwrap();
        let mut instance = template.instantiate(&Limits::default()).unwrap();
        let mut model = Model::new(&spec);
        let mut values = Cells::new(n as u64);
        for now in 1..4 {
            let arguments = values.of(&spec.argument_leaves());
            let ins: Vec<u32> = (0..arguments.len() as u32).collect();
            let scan = Scan { now, ..first_scan() };
            let mut cells = arguments.clone();
            cells.resize(arguments.len() + spec.result_leaves().len(), 0);
            instance.execute(scan, &ins, ins.len() as u32, &mut cells).unwrap();
            assert_eq!(cells[ins.len()..], model.execute(scan, &arguments), "{path:?}");
        }
    }
}

/// Every file below a folder with its content.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let kind = fs::symlink_metadata(&path).unwrap();
        if kind.is_dir() {
            found.extend(files(&path));
        } else {
            found.insert(path.clone(), fs::read(&path).unwrap_or_default());
        }
    }
    found
}

/// A cache that holds the three classes on both paths.
fn filled() -> (tempfile::TempDir, BTreeMap<PathBuf, Vec<u8>>) {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    for n in 0..3 {
        right(&cache, n);
    }
    let found = files(&cache);
    assert!(found.len() >= 6, "three components on two paths: {found:?}", found = found.keys());
    (folder, found)
}

fn cache(folder: &tempfile::TempDir) -> PathBuf {
    folder.path().join("cache")
}

fn all_right(cache: &Path) {
    (0..3).for_each(|n| right(cache, n));
}

/// What was spoiled is as it was before, and nothing else has appeared.
fn rebuilt(folder: &tempfile::TempDir, good: &BTreeMap<PathBuf, Vec<u8>>) {
    let now = files(&cache(folder));
    let names = |files: &BTreeMap<PathBuf, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&now), names(good));
    for (path, content) in good {
        assert!(now[path] == *content, "{} was not rebuilt", path.display());
    }
}

#[test]
fn a_good_file_is_used_and_not_written_again() {
    let (folder, good) = filled();
    let stamps = |files: &BTreeMap<PathBuf, Vec<u8>>| {
        files.keys().map(|p| fs::metadata(p).map(|m| (m.ino(), m.mtime(), m.mtime_nsec())).unwrap()).collect::<Vec<_>>()
    };
    let before = stamps(&good);
    all_right(&cache(&folder));
    rebuilt(&folder, &good);
    assert_eq!(stamps(&good), before);
}

#[test]
fn others_may_not_write_what_it_makes() {
    let (folder, good) = filled();
    let mut paths: Vec<PathBuf> = good.into_keys().collect();
    paths.push(cache(&folder));
    for path in paths {
        let mode = fs::metadata(&path).unwrap().mode();
        assert_eq!(mode & 0o022, 0, "{}: {mode:o}", path.display());
    }
}

#[test]
fn truncated_files() {
    let (folder, good) = filled();
    for keep in [0, 1, 7, 8, 40, 100] {
        for (path, content) in &good {
            fs::write(path, &content[..keep.min(content.len())]).unwrap();
        }
        all_right(&cache(&folder));
        rebuilt(&folder, &good);
    }
    for cut in [1, 100] {
        for (path, content) in &good {
            fs::write(path, &content[..content.len() - cut]).unwrap();
        }
        all_right(&cache(&folder));
        rebuilt(&folder, &good);
    }
}

#[test]
fn files_with_more_behind_the_end() {
    let (folder, good) = filled();
    for (path, content) in &good {
        fs::write(path, [&content[..], &[0; 16]].concat()).unwrap();
    }
    all_right(&cache(&folder));
    rebuilt(&folder, &good);
}

#[test]
fn a_flipped_bit_at_every_place_of_the_header() {
    let (folder, good) = filled();
    for at in 0..200 {
        for (path, content) in &good {
            let mut bad = content.clone();
            bad[at] ^= 1 << (at % 8);
            fs::write(path, bad).unwrap();
        }
        right(&cache(&folder), at % 3);
    }
    all_right(&cache(&folder));
    rebuilt(&folder, &good);
}

#[test]
fn files_of_two_components_swapped() {
    let (folder, good) = filled();
    let paths: Vec<&PathBuf> = good.keys().collect();
    for shift in 1..paths.len() {
        for (i, path) in paths.iter().enumerate() {
            fs::write(path, &good[paths[(i + shift) % paths.len()]]).unwrap();
        }
        all_right(&cache(&folder));
        rebuilt(&folder, &good);
    }
}

/// The code of one component under the header of another, wherever the header ends.
#[test]
fn one_files_header_on_anothers_code() {
    let (folder, good) = filled();
    let paths: Vec<&PathBuf> = good.keys().collect();
    for header in [8, 16, 32, 40, 48, 64, 72, 80, 96, 104, 128, 160, 192] {
        for (i, path) in paths.iter().enumerate() {
            let other = &good[paths[(i + 1) % paths.len()]];
            fs::write(path, [&good[*path][..header], &other[header..]].concat()).unwrap();
        }
        all_right(&cache(&folder));
        rebuilt(&folder, &good);
    }
}

/// Who can write a file can put anything into it: a file that others may write is not used, good as it looks.
#[test]
fn files_that_others_may_write() {
    let (folder, good) = filled();
    for mode in [0o620, 0o602, 0o666, 0o777] {
        let mut inodes = Vec::new();
        for path in good.keys() {
            fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
            inodes.push(fs::metadata(path).unwrap().ino());
        }
        all_right(&cache(&folder));
        for path in good.keys() {
            let now = fs::metadata(path).unwrap();
            assert_eq!(now.mode() & 0o022, 0, "{}: it was made anew with mode {:o}", path.display(), now.mode());
        }
        rebuilt(&folder, &good);
    }
}

#[test]
fn files_of_another_owner() {
    let (folder, good) = filled();
    let path = good.keys().next().unwrap();
    // Only root can give a file away; everyone else cannot get into this situation here.
    if std::os::unix::fs::chown(path, Some(65534), None).is_ok() {
        all_right(&cache(&folder));
        rebuilt(&folder, &good);
        assert_ne!(fs::metadata(path).unwrap().uid(), 65534);
    }
}

/// In a folder that others may write, files may be put and replaced at any time: nothing there is used or made.
#[test]
fn a_folder_that_others_may_write() {
    for mode in [0o770, 0o707, 0o777, 0o1777] {
        let (folder, good) = filled();
        let path = good.keys().next().unwrap();
        fs::write(path, b"evil").unwrap();
        fs::set_permissions(cache(&folder), fs::Permissions::from_mode(mode)).unwrap();
        all_right(&cache(&folder));
        assert_eq!(fs::read(path).unwrap(), b"evil", "mode {mode:o}: the cache is left alone");
    }
}

#[test]
fn symbolic_links() {
    let (folder, good) = filled();
    let elsewhere = folder.path().join("elsewhere");
    fs::create_dir(&elsewhere).unwrap();
    for (i, (path, content)) in good.iter().enumerate() {
        let target = elsewhere.join(i.to_string());
        // Some hold what should be there, some what should not.
        fs::write(&target, if i % 2 == 0 { &content[..] } else { b"precious" }).unwrap();
        fs::remove_file(path).unwrap();
        symlink(&target, path).unwrap();
    }
    all_right(&cache(&folder));
    rebuilt(&folder, &good);
    for (i, path) in good.keys().enumerate() {
        assert!(fs::symlink_metadata(path).unwrap().is_file(), "{} is no link any more", path.display());
        let expected = if i % 2 == 0 { &good[path][..] } else { b"precious" };
        assert_eq!(fs::read(elsewhere.join(i.to_string())).unwrap(), expected, "nothing was written through the link");
    }
}

/// A folder, a link to nowhere and a named pipe in place of a file: no hang either.
#[test]
fn things_that_are_no_files() {
    let (folder, good) = filled();
    for (i, path) in good.keys().enumerate() {
        fs::remove_file(path).unwrap();
        match i % 3 {
            0 => fs::create_dir(path).unwrap(),
            1 => symlink(folder.path().join("nowhere"), path).unwrap(),
            _ => {
                let made = std::process::Command::new("mkfifo").arg(path).status().unwrap();
                assert!(made.success());
            }
        }
    }
    all_right(&cache(&folder));
}

/// Without a folder it can write to, everything works as without a cache.
#[test]
fn no_folder_to_write_to() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, b"a file").unwrap();
    all_right(&file);
    assert_eq!(fs::read(&file).unwrap(), b"a file");
    all_right(&file.join("below"));
    let read_only = folder.path().join("read-only");
    fs::create_dir(&read_only).unwrap();
    fs::set_permissions(&read_only, fs::Permissions::from_mode(0o500)).unwrap();
    all_right(&read_only);
    let linked = folder.path().join("linked");
    symlink(folder.path().join("nowhere/at/all"), &linked).unwrap();
    all_right(&linked);
}

proptest! {
    #![proptest_config(strategy::config(60))]

    #[test]
    fn a_flipped_bit_anywhere(n in 0..3usize, at: prop::sample::Index, bit in 0..8u8) {
        let (folder, good) = filled_once();
        for (path, content) in good {
            let mut bad = content.clone();
            bad[at.index(content.len())] ^= 1 << bit;
            fs::write(path, bad).unwrap();
        }
        right(&cache(folder), n);
        all_right(&cache(folder));
        rebuilt(folder, good);
    }
}

/// The property's folder: filled once, and whole again after every case.
fn filled_once() -> &'static (tempfile::TempDir, BTreeMap<PathBuf, Vec<u8>>) {
    static FILLED: std::sync::LazyLock<(tempfile::TempDir, BTreeMap<PathBuf, Vec<u8>>)> =
        std::sync::LazyLock::new(filled);
    &FILLED
}

// ---- several at once ----

const CHILD: &str = "LATCHWORK_TEST_CACHE";

#[test]
fn threads_and_processes_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    let children: Vec<_> = (0..3)
        .map(|_| {
            std::process::Command::new(std::env::current_exe().unwrap())
                .args(["--exact", "loads_again_and_again", "--ignored"])
                .env(CHILD, &cache)
                .stdout(std::process::Stdio::null())
                .spawn()
                .unwrap()
        })
        .collect();
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| all_right(&cache));
        }
    });
    for mut child in children {
        assert!(child.wait().unwrap().success());
    }
    let left = files(&cache);
    all_right(&cache);
    assert!(files(&cache) == left, "the cache is whole");
    assert!(left.len() >= 6 && left.len().is_multiple_of(6), "no unfinished files are left: {:?}", left.keys());
}

#[test]
#[ignore = "started by threads_and_processes_at_once as a process of its own"]
fn loads_again_and_again() {
    let cache = PathBuf::from(std::env::var_os(CHILD).unwrap());
    for _ in 0..5 {
        all_right(&cache);
    }
}
