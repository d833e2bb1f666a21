//! Taps: a listener off the lane gets what a block got and gave, whole or counted as missed.

use latchwork_plant::assemble::{Plant, Time};
use latchwork_plant::lane::{Frame, Mode, Request, TapReader, TapSlot, TapState, tap};
use latchwork_tests_plant::Rig;

const MS: u64 = 1_000_000;

const PLANT: &str = r#"
[lane.main]
every = "10ms"
[block.clock]
component = "multivibrator"
lane = "main"
inputs.run = true
settings.on-time = "20ms"
settings.off-time = "20ms"
[block.count]
component = "ctu"
lane = "main"
inputs.cu = "clock.outputs.out"
inputs.pv = 1000
"#;

fn listen(plant: &mut Plant, block: usize, frames: usize) -> TapReader {
    listen_at(plant, block, frames, TapSlot::Recorder)
}

fn listen_at(plant: &mut Plant, block: usize, frames: usize, slot: TapSlot) -> TapReader {
    let (tap, reader) = tap(&plant.model.blocks[block].class, frames, None);
    send(plant, Request::Tap { block: block as u32, slot, tap });
    reader
}

fn send(plant: &mut Plant, request: Request) {
    assert!(plant.supervisor.send(0, request).is_ok());
}

fn scan(plant: &mut Plant, from: u64, n: u64) {
    for i in from..from + n {
        plant.lanes[0].scan(i * 10 * MS, i * 10 * MS, || i * 10 * MS);
        plant.lanes[0].spare((i + 1) * 10 * MS, || i * 10 * MS);
    }
}

/// What a tap told, a line per frame.
fn told(reader: &mut TapReader) -> Vec<String> {
    let mut lines = Vec::new();
    while let Some((missed, frame)) = reader.next_frame() {
        let lost = if missed > 0 { format!("after {missed} missed: ") } else { String::new() };
        lines.push(match frame {
            Frame::Execution { scan, arguments, outputs, .. } => {
                let first = if scan.first { " first" } else { "" };
                format!("{lost}{} ms{first}: {arguments:?} -> {outputs:?}", scan.now / MS)
            }
            other => format!("{lost}{other:?}"),
        });
    }
    lines
}

#[test]
fn the_first_frame_is_the_state_then_comes_every_execution_with_its_arguments_and_outputs() {
    let mut plant = Rig::new(PLANT).plant(Time::Virtual);
    let mut reader = listen(&mut plant, 1, 16);
    scan(&mut plant, 0, 4);
    assert_eq!(
        told(&mut reader),
        [
            "State { last: 0, state: Cold }",
            "0 ms first: [1, 0, 1000] -> Ok([0, 1])",
            "10 ms: [1, 0, 1000] -> Ok([0, 1])",
            "20 ms: [0, 0, 1000] -> Ok([0, 1])",
            "30 ms: [0, 0, 1000] -> Ok([0, 1])"
        ]
    );
}

#[test]
fn a_tap_put_on_later_begins_with_what_the_block_retains() {
    let mut plant = Rig::new(PLANT).plant(Time::Virtual);
    scan(&mut plant, 0, 12);
    let mut reader = listen(&mut plant, 1, 16);
    scan(&mut plant, 12, 1);
    let (_, frame) = reader.next_frame().expect("a frame");
    let Frame::State { last, state: TapState::Retained(cells) } = frame else { panic!("{frame:?}") };
    assert_eq!(last, 120 * MS, "it was saved after the scan that took the tap");
    assert_eq!(cells.len(), plant.model.blocks[1].class.retained.len());
    assert!(cells.contains(&4), "four pulses were counted: {cells:?}");
    assert_eq!(told(&mut reader), [""; 0], "no execution comes before its state");
    scan(&mut plant, 13, 1);
    assert!(told(&mut reader)[0].starts_with("130 ms: "));
}

/// A scan whose spare time ends `spare` after it began, by a clock that stands still in it.
fn scan_with(plant: &mut Plant, i: u64, spare: u64) {
    plant.lanes[0].scan(i * 10 * MS, i * 10 * MS, || i * 10 * MS);
    plant.lanes[0].spare(i * 10 * MS + spare, || i * 10 * MS);
}

#[test]
fn a_state_waits_for_time_between_two_scans_but_not_for_ever() {
    let mut plant = Rig::new(PLANT).plant(Time::Virtual);
    scan(&mut plant, 0, 12);
    let mut reader = listen(&mut plant, 1, 256);
    // No time is left, for less than a second.
    (12..110).for_each(|i| scan_with(&mut plant, i, 0));
    assert_eq!(told(&mut reader), [""; 0]);
    send(&mut plant, Request::Keyframe { block: 1, version: 0, slot: TapSlot::Recorder });
    (110..115).for_each(|i| scan_with(&mut plant, i, 0));
    let lines = told(&mut reader);
    assert!(lines[0].starts_with("State { last: 1120000000, state: Retained("), "{lines:?}");
    assert_eq!(lines.len(), 3, "one state, whoever asked for it, and the executions after it: {lines:?}");
}

#[test]
fn at_most_one_state_is_saved_between_two_scans() {
    let mut plant = Rig::new(PLANT).plant(Time::Virtual);
    scan(&mut plant, 0, 3);
    let mut readers = [TapSlot::Recorder, TapSlot::Shadow].map(|slot| listen_at(&mut plant, 1, 16, slot));
    scan(&mut plant, 3, 1);
    assert_eq!(readers.each_mut().map(|r| told(r).len()), [1, 0]);
    scan(&mut plant, 4, 1);
    assert_eq!(readers.each_mut().map(|r| told(r).len()), [1, 1]);
}

#[test]
fn what_retains_nothing_or_is_cold_is_told_at_once() {
    let mut plant = Rig::new(PLANT).plant(Time::Virtual);
    let mut cold = listen(&mut plant, 1, 16);
    scan_with(&mut plant, 0, 0);
    assert_eq!(told(&mut cold)[0], "State { last: 0, state: Cold }");
}

#[test]
fn frames_that_find_no_room_are_counted_and_the_next_one_says_so() {
    let mut plant = Rig::new(PLANT).plant(Time::Virtual);
    let mut reader = listen(&mut plant, 1, 4);
    scan(&mut plant, 0, 100);
    let lines = told(&mut reader);
    let kept = lines.len();
    assert!((4..=8).contains(&kept), "{kept} frames in room for 4 of the longest");
    assert!(lines.iter().all(|l| !l.contains("missed")), "{lines:?}");
    scan(&mut plant, 100, 1);
    let missed = 101 - kept;
    assert!(told(&mut reader)[0].starts_with(&format!("after {missed} missed: 1000 ms: ")));
    scan(&mut plant, 101, 1);
    assert!(told(&mut reader)[0].starts_with("1010 ms: "), "and nothing is missed any more");
}

#[test]
fn recorder_and_shadow_listen_to_the_same_block_and_end_each_for_itself() {
    let mut plant = Rig::new(PLANT).plant(Time::Virtual);
    let mut recorder = listen_at(&mut plant, 0, 16, TapSlot::Recorder);
    let mut shadow = listen_at(&mut plant, 0, 16, TapSlot::Shadow);
    scan(&mut plant, 0, 2);
    assert_eq!(told(&mut recorder), told(&mut shadow));
    send(&mut plant, Request::Untap { block: 0, slot: TapSlot::Shadow });
    scan(&mut plant, 2, 2);
    assert_eq!(told(&mut shadow), ["Ended"]);
    assert_eq!(told(&mut recorder).len(), 2);
    assert!(!recorder.is_over());
}

#[test]
fn another_tap_in_the_same_place_ends_the_one_before() {
    let mut plant = Rig::new(PLANT).plant(Time::Virtual);
    let mut one = listen(&mut plant, 0, 16);
    scan(&mut plant, 0, 1);
    told(&mut one);
    let mut two = listen(&mut plant, 0, 16);
    scan(&mut plant, 1, 1);
    assert_eq!(told(&mut one), ["Ended"]);
    assert_eq!(told(&mut two).len(), 1, "the state");
    scan(&mut plant, 2, 1);
    assert_eq!(told(&mut two).len(), 1, "an execution");
}

const FAULTY: &str = r#"
[lane.main]
every = "10ms"
[block.bad]
component = "stress"
lane = "main"
inputs.from = 3
inputs.fault = "trap"
"#;

#[test]
fn a_fault_has_no_outputs_and_a_restart_is_told() {
    let mut plant = Rig::new(FAULTY).plant(Time::Virtual);
    let mut reader = listen(&mut plant, 0, 64);
    for i in 0..20 {
        scan(&mut plant, i, 1);
        plant.supervisor.pump();
    }
    let lines = told(&mut reader);
    let fault = lines.iter().position(|l| l.ends_with("-> Err(Trap)")).expect("a fault");
    assert_eq!(lines[fault + 1], "Restarted", "{lines:#?}");
    assert!(lines[fault + 2].contains(" first: "), "{lines:#?}");
}

#[test]
fn commands_are_among_the_arguments_for_the_execution_that_sees_them() {
    let plant =
        "[lane.main]\nevery = \"10ms\"\n[block.unit]\ncomponent = \"alarm-unit\"\nlane = \"main\"\ninputs.level = 1\n";
    let mut plant = Rig::new(plant).plant(Time::Virtual);
    let class = plant.model.blocks[0].class.clone();
    let mut reader = listen(&mut plant, 0, 16);
    scan(&mut plant, 0, 1);
    send(&mut plant, Request::Command { block: 0, bit: 0, mode: Mode::OneShot });
    scan(&mut plant, 1, 2);
    let mut words = Vec::new();
    while let Some((_, frame)) = reader.next_frame() {
        if let Frame::Execution { arguments, .. } = frame {
            words.push(arguments[class.argument_cells() - 1]);
        }
    }
    assert_eq!(words, [0, 1, 0]);
}
