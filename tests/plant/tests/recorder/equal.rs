//! Replays that are equal, and those that are not.

use super::*;

#[test]
fn what_a_plant_has_recorded_is_replayed_equal_bit_for_bit() {
    let (_folder, path) = recorded();
    let recording = Recording::open(&path).expect("a recording");
    assert_eq!(recording.damage, Vec::<String>::new());
    let blocks: Vec<_> = recording.blocks(1).map(|(name, _)| name.to_string()).collect();
    assert_eq!(blocks, ["count", "unit"], "those that were chosen, and no others");
    for block in ["count", "unit"] {
        let replayed = again(&recording, block, &Options::default());
        assert!(replayed.equal(), "{replayed:#?}");
        assert_eq!((replayed.executions, replayed.skipped, replayed.missed), (300, 0, 0));
        assert_eq!(replayed.recorded, replayed.replayed);
        assert_eq!(replayed.notes, Vec::<String>::new());
    }
}

#[test]
fn a_replay_of_a_later_part_begins_with_the_state_before_it() {
    let (_folder, path) = recorded();
    let recording = Recording::open(&path).expect("a recording");
    for block in ["count", "unit"] {
        let options = Options { from: 2 * SECOND, to: 2 * SECOND + 499_999_999, ..Options::default() };
        let replayed = again(&recording, block, &options);
        assert!(replayed.equal(), "{replayed:#?}");
        assert_eq!((replayed.from, replayed.executions), (2 * SECOND, 50));
    }
}

#[test]
fn the_same_run_makes_the_same_recording_to_the_byte() {
    let bytes = || {
        let (_folder, path) = recorded();
        Recording::open(&path).expect("a recording").to_bytes()
    };
    assert_eq!(bytes(), bytes());
}

#[test]
fn a_changed_recording_is_found_different() {
    let (_folder, path) = recorded();
    let recording = Recording::open(&path).expect("a recording");
    let (_, segments) = recording.blocks(1).find(|(name, _)| *name == "count").expect("the block");
    // The same executions, but for one output of the second segment that says something else.
    let segment = &segments[1];
    let mut at = 0;
    let mut writer = Writer::new(Head { executions: 0, missed: 0, ..segment.head.clone() });
    each_event(std::slice::from_ref(segment), |event| {
        let Event::Execution { scan, arguments, outputs: Ok(outputs) } = event else { return };
        let mut outputs = outputs.to_vec();
        outputs[1] ^= u64::from(at == 7);
        writer.add(Event::Execution { scan, arguments, outputs: Ok(&outputs) });
        at += 1;
    });
    let changed = writer.cut(Start::Continued).expect("not empty");
    let all = segments.iter().enumerate().map(|(n, segment)| if n == 1 { &changed } else { segment });
    let (_folder, recording) = written(&recording, all);
    let replayed = again(&recording, "count", &Options::default());
    assert!(!replayed.equal());
    assert_ne!(replayed.recorded, replayed.replayed);
    assert_eq!(replayed.different, 1);
    assert_eq!(replayed.deviations[0].port, "outputs.cv");
    assert_eq!(replayed.deviations[0].worst, 1.0);
}

#[test]
fn settings_and_commands_are_in_the_recording() {
    let (_folder, recording) = counter(&Counter::new(1), "10s");
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!(replayed.executions, 100);
    let mut settings = 0;
    each_event(segments(&recording), |event| settings += u64::from(matches!(event, Event::Settings { .. })));
    assert_eq!(settings, 1);
}

#[test]
fn settings_written_between_two_executions_are_replayed_and_reach_the_shadow() {
    // Twice between the same two executions, and while a lane that has no time to spare still owes the shadow a state.
    let rows = "0.4s,n.settings.step,5\n0.404s,n.settings.step,7\n1s,swap.n,v2.wasm shadow=150 probation=5\n\
                1.5s,n.settings.step,3\n2.5s,n.settings.step,4\n";
    let text = "[recorder]\nblocks = [\"n\"]\nkeyframe = \"300ms\"\n[lane.main]\nevery = \"10ms\"\n\
                [block.n]\ncomponent = \"v1.wasm\"\nlane = \"main\"\n[sim.scan-time]\nmain = \"10ms\"\n";
    let counter = Counter::new(1).component();
    let other = Counter { default_step: 9, ..Counter::new(1) }.component();
    let rig = Rig::new(text).sim().with("v1", &counter).with("v2", &other);
    let folder = TempDir::new().expect("a temporary folder");
    let records = run(rig.plant(Time::Virtual), Some(folder.path()), rows, 5 * SECOND);
    let swaps: Vec<_> = records.iter().filter(|r| r.kind == Kind::Swap).map(|r| &*r.transition).collect();
    assert_eq!(swaps, ["asked", "shadow", "exchanged", "kept"], "{records:#?}");
    let recording = Recording::open(folder.path()).expect("a recording");
    let replayed = again(&recording, "n", &Options::default());
    assert!(replayed.equal(), "{replayed:#?}");
    assert_eq!((replayed.executions, replayed.skipped), (500, 0));
}

#[test]
fn a_class_that_retains_nothing_is_exact_only_from_its_cold_start_and_the_report_says_so() {
    let (_folder, recording) = counter(&Counter { retained: None, ..Counter::new(1) }, "200ms");
    let whole = again(&recording, "n", &Options::default());
    assert!(whole.equal() && whole.notes.is_empty(), "{whole:#?}");
    // Without its beginning, as after the oldest files have gone.
    let (_folder, late) = written(&recording, &segments(&recording)[1..]);
    let late = again(&late, "n", &Options::default());
    assert!(late.notes.iter().any(|n| n.contains("retains nothing")), "{late:#?}");
    assert!(!late.equal(), "its count is not in the recording");
}

#[test]
fn an_interrupt_lane_is_recorded_with_the_times_of_its_edges_and_replayed_equal() {
    let edges = "100.3ms,gpio.door,true\n100.7ms,gpio.door,false\n0.5s,n.settings.step,7\n731.000001ms,gpio.door,true\n\
                 1.2s,n.commands.clear,true\n1.234s,gpio.door,false\n1.8s,gpio.door,true\n";
    for (also, least) in [("also-with = \"main\"", 200), ("", 5)] {
        let text = format!(
            "[recorder]\nlanes = [\"trip\"]\nkeyframe = \"200ms\"\n[lane.main]\nevery = \"10ms\"\n[lane.trip]\n\
             on = [\"gpio.door\"]\n{also}\n[driver.gpio]\nkind = \"sim\"\npoints.door = {{ type = \"bool\" }}\n\
             [block.n]\ncomponent = \"counter.wasm\"\nlane = \"trip\"\n\
             [block.other]\ncomponent = \"counter.wasm\"\nlane = \"main\"\n"
        );
        let rig = Rig::new(&text).with("counter", &Counter::new(1).component());
        let folder = TempDir::new().expect("a temporary folder");
        run(rig.plant(Time::Virtual), Some(folder.path()), edges, 2 * SECOND);
        let recording = Recording::open(folder.path()).expect("a recording");
        assert_eq!(recording.blocks(1).map(|(name, _)| name).collect::<Vec<_>>(), ["n"]);
        let replayed = again(&recording, "n", &Options::default());
        assert!(replayed.equal(), "{replayed:#?}");
        assert!(replayed.executions >= least && replayed.skipped == 0, "{replayed:#?}");
        let segments = segments(&recording);
        assert!(segments.iter().any(|s| matches!(s.head.start, Start::State(_))), "states come without edges, too");
        let mut times = Vec::new();
        each_event(segments, |event| {
            if let Event::Execution { scan, .. } = event {
                times.push(scan.now);
            }
        });
        for edge in [100_300_000, 100_700_000, 731_000_001, 1_234_000_000, 1_800_000_000] {
            assert!(times.contains(&edge), "{edge}: {times:?}");
        }
    }
}

#[test]
fn recording_changes_nothing_of_what_the_plant_does() {
    let without = PLANT.replacen("[recorder]\nblocks = [\"unit\", \"count\"]\nkeyframe = \"500ms\"\n", "", 1);
    let ran = |text: &str| Rig::new(text).stimulus(STIMULUS).run_for(3 * SECOND);
    let (with, without) = (ran(PLANT), ran(&without));
    assert_eq!(with.trace, without.trace);
    assert_eq!(with.records, without.records);
    assert!(with.told(Kind::Lost).is_empty());
}

#[test]
fn recorded_time_becomes_a_component_test() {
    let (_folder, path) = recorded();
    let recording = Recording::open(&path).expect("a recording");
    let engine = engine();
    let _ticker = Ticker::start(&engine, Duration::from_millis(10));
    let options = Options { to: 2 * SECOND, ..Options::default() };
    let exported = export(&recording, &engine, 1, "count", &options).expect("a test");
    assert_eq!(exported.executions, 201);
    assert!(exported.steps < 120, "only where something changed: {}", exported.steps);
    let text: Vec<_> = exported.text.lines().take(32).collect();
    insta::assert_snapshot!(text.join("\n"));
}
