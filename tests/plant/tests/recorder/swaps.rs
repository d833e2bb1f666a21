//! Swaps and roll-backs in recordings.

use super::*;

#[test]
fn the_first_execution_of_a_version_that_comes_with_a_swap_is_recorded_too() {
    let versions = [&Counter::new(1), &Counter::new(2).bad(Bad::Trap(31))];
    let (_, recording) = swapped(versions, "1s,swap.n,v2.wasm probation=5\n", "10s", 2 * SECOND);
    let replayed = again(&recording, "n", &Options::default());
    // The trap is at the 31st execution of the instance: it happens again only if none before it is missing.
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!((replayed.skipped, replayed.missed), (0, 0));
    assert_eq!(replayed.notes, Vec::<String>::new());
    let (_, segments) = recording.blocks(1).next().expect("a block");
    let second = segments.iter().find(|s| s.head.hash != segments[0].head.hash).expect("segments of the new version");
    assert_eq!((second.head.from, &second.head.start), (SECOND, &Start::State(vec![100])));
}

#[test]
fn a_version_that_comes_back_from_a_roll_back_is_replayed_as_it_stood() {
    // The one that waits remembers what it does not retain, too.
    for retained in [None, Some("u32")] {
        let versions =
            [&Counter { retained, ..Counter::new(1) }, &Counter { retained, ..Counter::new(2) }.bad(Bad::Trap(31))];
        let rows = "1s,swap.n,v2.wasm probation=100\n1.1s,n.settings.step,3\n";
        let (records, recording) = swapped(versions, rows, "10s", 2 * SECOND);
        assert!(records.iter().any(|r| r.kind == Kind::Swap && r.transition == "rolled-back"), "{records:#?}");
        let replayed = again(&recording, "n", &Options::default());
        assert!(replayed.equal(), "{replayed:#?}");
        // 100, then 31 of the other one, the last of which failed and was executed again by the one before: 70.
        assert_eq!((replayed.executions, replayed.skipped, replayed.missed), (201, 0, 0), "{replayed:#?}");
        assert_eq!(replayed.notes, Vec::<String>::new());
        assert_eq!((replayed.from, replayed.to), (0, 2 * SECOND - 10_000_000));
    }
}

#[test]
fn a_swap_and_a_roll_back_by_hand_in_the_middle_are_replayed_equal() {
    // Within the probation, and long after it, with settings written to either version.
    for (probation, retained) in [(100, None), (100, Some("u32")), (5, None), (5, Some("u32"))] {
        let versions = [&Counter { retained, ..Counter::new(1) }, &Counter { retained, ..Counter::new(2) }];
        let rows = format!(
            "0.5s,n.settings.step,2\n1s,swap.n,v2.wasm probation={probation}\n1.2s,n.settings.step,3\n\
             1.5s,rollback.n,1\n1.7s,n.settings.step,4\n1.8s,n.commands.clear,true\n"
        );
        let (records, recording) = swapped(versions, &rows, "250ms", 2 * SECOND);
        assert!(records.iter().any(|r| r.kind == Kind::Swap && r.transition == "rolled-back"), "{records:#?}");
        let replayed = again(&recording, "n", &Options::default());
        // A version that waits no longer comes back with what it remembers, and the recording has what it retains.
        if (probation, retained) == (5, None) {
            assert!(replayed.notes.iter().any(|n| n.contains("retains nothing")), "{replayed:#?}");
            continue;
        }
        assert!(replayed.equal(), "probation {probation}, {retained:?}: {replayed:#?}");
        assert_eq!((replayed.executions, replayed.skipped, replayed.missed), (200, 0, 0));
        let (_, segments) = recording.blocks(1).next().expect("a block");
        let versions: std::collections::BTreeSet<_> = segments.iter().map(|s| &s.head.hash).collect();
        assert_eq!(versions.len(), 2, "both components are in it");
    }
}

#[test]
fn a_version_is_replayed_across_a_swap_to_the_very_same_component() {
    let versions = [&Counter::new(1), &Counter::new(1)];
    let (_, recording) = swapped(versions, "1s,swap.n,v2.wasm probation=5\n", "300ms", 2 * SECOND);
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!((replayed.executions, replayed.skipped), (200, 0));
}
