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
        let mut n = 0;
        let changed = segments(&recording).iter().map(|segment| {
            rewritten(segment, &mut n, |n, event| match event {
                Event::Execution { scan, arguments, .. } if n == 100 => {
                    Event::Execution { scan, arguments, outputs: Err(kind) }
                }
                event => event,
            })
        });
        let changed: Vec<_> = changed.collect();
        let (_folder, recording) = written(&recording, &changed);
        let replayed = again(&recording, "n", &Options::default());
        assert_eq!(replayed.equal(), equal, "{replayed:#?}");
        assert_eq!(replayed.recorded == replayed.replayed, equal);
        assert_eq!(replayed.different, u64::from(!equal));
        assert_eq!(replayed.notes.len(), 1);
        assert!(replayed.notes[0].starts_with(note), "{replayed:#?}");
    }
}
