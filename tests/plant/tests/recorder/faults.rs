//! Faults in recordings.

use super::*;

#[test]
fn faults_and_restarts_are_replayed_too() {
    let (_folder, recording) = counter(&Counter::new(1).bad(Bad::Trap(31)), "10s");
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert!(replayed.executions > 31, "also what came after its restart: {}", replayed.executions);
    assert_eq!(replayed.skipped, 0);
}

#[test]
fn a_budget_that_was_exceeded_is_left_out_of_the_comparison_and_told() {
    let (_folder, recording) = counter(&Counter::new(1).bad(Bad::Loop(31)), "10s");
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!(replayed.recorded, replayed.replayed);
    assert_eq!(replayed.skipped, 0);
    assert!(replayed.executions > 31, "also what came after its restart: {}", replayed.executions);
    let faults = executions(&recording, "n") - replayed.executions;
    assert_eq!((faults, replayed.notes.len()), (2, 2), "{replayed:#?}");
    assert!(replayed.notes[0].starts_with("at 300ms it exceeded its budget when it was recorded"), "{replayed:#?}");
}

#[test]
fn a_recorded_fault_of_another_kind_does_not_depend_on_the_machine() {
    let (_folder, recording) = counter(&Counter::new(1), "10s");
    for (kind, equal, note) in [
        (FaultKind::Trap, false, "the recorded fault (trap) at 990ms did not happen again"),
        (FaultKind::Budget, true, "at 990ms it exceeded its budget when it was recorded"),
    ] {
        let (_folder, recording) = rewritten(&recording, |n, event| match event {
            Event::Execution { scan, arguments, .. } if n == 100 => {
                Event::Execution { scan, arguments, outputs: Err(kind) }
            }
            event => event,
        });
        let replayed = again(&recording, "n", &Options::default());
        assert_eq!(replayed.equal(), equal, "{replayed:#?}");
        assert_eq!(replayed.recorded == replayed.replayed, equal);
        assert_eq!(replayed.different, u64::from(!equal));
        assert_eq!(replayed.notes.len(), 1);
        assert!(replayed.notes[0].starts_with(note), "{replayed:#?}");
    }
}

/// The same recording of a counter with other events; the first one is number 0.
fn rewritten(
    recording: &Recording,
    mut change: impl for<'a> FnMut(usize, Event<'a>) -> Event<'a>,
) -> (TempDir, Recording) {
    let mut bytes = latchwork_testbed::replay::header();
    let (_, segments) = recording.blocks(1).next().expect("a block");
    let component = recording.component(&segments[0].head.hash).expect("its component");
    bytes.extend(latchwork_testbed::replay::component_chunk(component));
    let mut n = 0;
    for segment in segments {
        let head = Head { executions: 0, missed: 0, ..segment.head.clone() };
        let mut writer = latchwork_testbed::replay::Writer::new(head);
        let mut events = segment.events();
        while let Some(event) = events.next_event().expect("whole") {
            writer.add(change(n, event));
            n += 1;
        }
        bytes.extend(latchwork_testbed::replay::segment_chunk(&writer.cut(Start::Continued).expect("not empty")));
    }
    let folder = TempDir::new().expect("a folder");
    let file = folder.path().join("rewritten.latchrec");
    std::fs::write(&file, bytes).expect("written");
    let recording = Recording::open(&file).expect("a recording");
    (folder, recording)
}

#[test]
fn a_block_whose_state_cannot_be_saved_is_not_put_out_of_order_by_the_recorder() {
    let versions = [&Counter::new(1).bad(Bad::Save), &Counter::new(2)];
    let (records, recording) = swapped(versions, "", "100ms", 2 * SECOND);
    let faults = records.iter().filter(|r| r.kind == Kind::Fault && r.source == "n").count();
    let fault = |r: &&Record| r.kind == Kind::Fault && r.source == "n" && r.transition == "trap";
    assert!(records.iter().filter(fault).count() <= 1, "asked once at most: {faults} {records:#?}");
    assert!(!records.iter().any(|r| r.transition == "parked"), "{records:#?}");
    assert!(executions(&recording, "n") > 150);
}
