//! Whatever happens to the files, the last or the last but one is read, or it is said that nothing is left.

use latchwork_retain::{BLOCK, Damage, FILES, Retained, Saved, Store, Trouble, Version, decode, encode, read};
use proptest::prelude::*;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const LIMIT: Duration = Duration::from_secs(30);

fn folder() -> TempDir {
    TempDir::new().expect("a temporary folder")
}

/// States of some blocks of two classes; their cells are `seed` and what follows.
fn states(blocks: usize, seed: u64) -> Retained {
    let version = |class: &str, schema: &str| {
        let (component, hash, schema) = (class.to_owned(), "ab".repeat(32), schema.to_owned());
        Arc::new(Version { class: format!("latchwork:device/{class}@0.1.0"), component, hash, schema })
    };
    let versions = [(version("ctu", "cv:s32,cu:bool"), 2), (version("mode", "mode:enum(off|on)"), 1)];
    let block = |n: usize| {
        let (version, fields) = versions[n % 2].clone();
        let cells = (0..fields).map(|i| seed.wrapping_mul(31).wrapping_add(i)).collect();
        (format!("zone.b{n}"), Arc::new(Saved { version, time: seed, wall: u64::MAX - seed, cells }))
    };
    Retained { blocks: (0..blocks).map(block).collect() }
}

/// Hands states to a store and waits until they are durable.
fn write(folder: &Path, all: &[Retained]) {
    for states in all {
        let (store, _) = Store::open(folder).expect("a store");
        store.vault().keep(Some(states.clone()), true);
        store.close(LIMIT).expect("durable");
    }
}

fn file(folder: &Path, slot: usize) -> Vec<u8> {
    std::fs::read(folder.join(FILES[slot])).expect("a file")
}

#[test]
fn a_first_start_finds_nothing_and_that_is_no_damage() {
    let folder = folder();
    let (store, opening) = Store::open(folder.path()).expect("a store");
    assert_eq!((opening.retained.blocks.len(), opening.damage.len()), (0, 0));
    assert!(!opening.lost() && opening.set_aside.is_empty());
    drop(store);
    // Nor is a second one after a run that kept nothing.
    let (_store, opening) = Store::open(folder.path()).expect("a store");
    assert!(!opening.lost() && opening.damage.is_empty());
}

#[test]
fn what_was_written_last_is_read_and_the_files_take_turns() {
    let folder = folder();
    let all: Vec<_> = (1..=5).map(|n| states(3, n)).collect();
    for (n, one) in all.iter().enumerate() {
        write(folder.path(), std::slice::from_ref(one));
        let found = read(folder.path());
        assert_eq!((found.retained, found.generation, found.slot), (one.clone(), n as u64 + 1, Some(n % 2)));
    }
}

#[test]
fn bytes_are_counted_in_whole_blocks_and_a_round_without_change_writes_none() {
    let folder = folder();
    let (store, _) = Store::open(folder.path()).expect("a store");
    let mut vault = store.vault();
    vault.keep(Some(states(2, 1)), true);
    let end = Instant::now() + LIMIT;
    while vault.figures().writes == 0 {
        assert!(Instant::now() < end, "never written");
        std::thread::yield_now();
    }
    vault.keep(None, true);
    vault.keep(Some(states(2, 2)), false);
    let figures = store.close(LIMIT).expect("durable");
    assert_eq!((figures.rounds, figures.writes, figures.bytes), (2, 2, 2 * BLOCK as u64));
    assert_eq!(figures.round_bytes, BLOCK as u64, "one of them was no round");
    // Two rounds of a minute with one block of 4 KiB: half of 1440 blocks a day.
    assert_eq!(figures.bytes_a_day(60_000_000_000), Some(720 * BLOCK as u64));
}

#[test]
fn two_plants_do_not_share_a_folder() {
    let folder = folder();
    let (_store, _) = Store::open(folder.path()).expect("a store");
    let error = Store::open(folder.path()).err().expect("it is taken").to_string();
    assert!(error.contains("another plant") && error.contains("its own"), "{error}");
}

#[test]
fn a_folder_that_is_not_there_is_told() {
    let folder = folder();
    let error = Store::open(&folder.path().join("gone")).err().expect("no folder").to_string();
    assert!(error.contains("gone"), "{error}");
}

#[test]
fn when_both_are_damaged_they_are_put_aside_and_a_new_state_begins() {
    let folder = folder();
    write(folder.path(), &[states(3, 1), states(3, 2)]);
    for name in FILES {
        std::fs::write(folder.path().join(name), "latchwork-retained 7 1 2 3\n").expect("damage");
    }
    let (store, opening) = Store::open(folder.path()).expect("a store");
    assert!(opening.lost());
    assert_eq!(opening.damage[0].1, Damage::Format { found: "7".into() });
    assert_eq!(opening.set_aside.len(), 2);
    assert!(opening.set_aside.iter().all(|p| std::fs::read(p).expect("it is there").starts_with(b"latchwork")));
    store.vault().keep(Some(states(3, 3)), false);
    store.close(LIMIT).expect("durable");
    assert_eq!(read(folder.path()).retained, states(3, 3));
}

#[test]
fn a_damaged_file_that_cannot_be_put_aside_is_no_reason_not_to_start() {
    let folder = folder();
    write(folder.path(), &[states(3, 1), states(3, 2)]);
    for name in FILES {
        std::fs::write(folder.path().join(name), "latchwork-retained 7 1 2 3\n").expect("damage");
    }
    // A folder stands where the copy of the first one would go.
    std::fs::create_dir(folder.path().join(format!("{}.damaged", FILES[0]))).expect("made");
    let (store, opening) = Store::open(folder.path()).expect("a store");
    assert_eq!(opening.set_aside, [folder.path().join(format!("{}.damaged", FILES[1]))]);
    assert_eq!(opening.not_aside.len(), 1);
    assert!(opening.not_aside[0].starts_with(FILES[0]), "{:?}", opening.not_aside);
    store.vault().keep(Some(states(3, 3)), false);
    store.close(LIMIT).expect("durable");
    assert_eq!(read(folder.path()).retained, states(3, 3));
}

#[test]
fn a_disk_that_takes_nothing_is_told_once_and_the_last_state_stays() {
    let folder = folder();
    write(folder.path(), &[states(3, 1), states(3, 2)]);
    // The file that would be written next is a device that is full.
    std::fs::remove_file(folder.path().join(FILES[0])).expect("removed");
    std::os::unix::fs::symlink("/dev/full", folder.path().join(FILES[0])).expect("a link");
    // A device without end is read as damage, not for ever.
    assert_eq!(read(folder.path()).damage, [(0, Damage::Long)]);
    let (store, opening) = Store::open(folder.path()).expect("a store");
    assert_eq!(opening.retained, states(3, 2));
    let mut vault = store.vault();
    vault.keep(Some(states(3, 3)), true);
    let end = Instant::now() + LIMIT;
    let told = loop {
        if let Some(told) = vault.trouble() {
            break told;
        }
        assert!(Instant::now() < end, "never told");
        std::thread::yield_now();
    };
    assert!(matches!(&told, Trouble::Refused(why) if why.contains("No space")), "{told:?}");
    vault.keep(Some(states(3, 4)), true);
    let why = store.close(LIMIT).expect_err("it is not durable");
    assert!(why.contains("No space"), "{why}");
    assert_eq!(vault.trouble(), None, "told once");
    assert_eq!(read(folder.path()).retained, states(3, 2));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Texts of all kinds come back as they were.
    #[test]
    fn any_state_comes_back(name in ".*", class in ".*", schema in ".*", cells in prop::collection::vec(any::<u64>(), 0..20),
                            time: u64, wall: u64, generation: u64) {
        let version = Arc::new(Version { class, component: name.clone(), hash: String::new(), schema });
        let saved = Arc::new(Saved { version, time, wall, cells: cells.into() });
        let states = Retained { blocks: [(name, saved)].into() };
        let bytes = encode(generation, &states).expect("it fits");
        prop_assert_eq!(bytes.len() % BLOCK, 0);
        prop_assert_eq!(decode(&bytes), Ok((generation, states)));
    }

    /// One flipped byte anywhere: what the file held, where it does not count, or damage; never another state.
    #[test]
    fn a_flipped_byte_is_noticed(blocks in 1usize..40, at: prop::sample::Index, flip in 1u8..) {
        let states = states(blocks, 7);
        let mut bytes = encode(3, &states).expect("it fits");
        let at = at.index(bytes.len());
        bytes[at] ^= flip;
        if let Ok(read) = decode(&bytes) {
            prop_assert_eq!(read, (3, states));
        }
    }

    /// A writing that was cut off leaves pieces of it among pieces of the older file: the newest or the other one is read.
    #[test]
    fn a_writing_that_is_cut_off_anywhere_leaves_the_last_or_the_last_but_one(
        blocks in 1usize..120, before in 1usize..120, piece in prop::sample::select(vec![1usize, 512, BLOCK]),
        done in prop::collection::vec(any::<bool>(), 1..40), until: prop::sample::Index,
    ) {
        let folder = folder();
        let all = [states(before, 1), states(blocks, 2), states(blocks, 3)];
        write(folder.path(), &all);
        // The third writing went over the first one; now only parts of it did.
        let (old, new) = (encode(1, &all[0]).expect("it fits"), file(folder.path(), 0));
        let until = until.index(new.len() + 1);
        let mut torn = old.clone();
        for (n, bytes) in new.chunks(piece).enumerate() {
            let at = n * piece;
            // In order up to a byte, and beyond it some that the disk took first.
            let whole = at + bytes.len() <= until || (piece > 1 && done[n % done.len()]);
            if whole {
                torn.resize(torn.len().max(at + bytes.len()), 0);
                torn[at..at + bytes.len()].copy_from_slice(bytes);
            }
        }
        std::fs::write(folder.path().join(FILES[0]), &torn).expect("damage");
        let found = read(folder.path());
        prop_assert!(found.retained == all[1] || found.retained == all[2], "generation {}", found.generation);
        // And it goes on from there.
        write(folder.path(), &[states(blocks, 9)]);
        prop_assert_eq!(read(folder.path()).retained, states(blocks, 9));
    }

    /// Both files cut anywhere, or full of anything: no panic, and nothing is read that was not written.
    #[test]
    fn any_damage_to_both_is_survived(cuts: [prop::sample::Index; 2], rubbish: Option<Vec<u8>>) {
        let folder = folder();
        let all = [states(5, 1), states(60, 2)];
        write(folder.path(), &all);
        for (slot, cut) in cuts.iter().enumerate() {
            let mut bytes = file(folder.path(), slot);
            bytes.truncate(cut.index(bytes.len() + 1));
            bytes.extend(rubbish.iter().flatten());
            std::fs::write(folder.path().join(FILES[slot]), bytes).expect("damage");
        }
        let found = read(folder.path());
        prop_assert!(found.slot.is_none() || all.contains(&found.retained));
        let (store, opening) = Store::open(folder.path()).expect("a store");
        prop_assert_eq!(latchwork_retain::Found { set_aside: Vec::new(), ..opening }, found);
        drop(store);
    }
}
