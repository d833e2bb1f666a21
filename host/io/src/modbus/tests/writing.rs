//! Writing: what, when, and what at the end.

use super::super::point::Table::*;
use super::bench::{Bench, pass, point, text};
use super::device::{Device, Mood, Wire};
use latchwork_image::Quality;
use latchwork_schema::Value::Integer;

fn writes(device: &Device) -> Vec<String> {
    device.take_log().into_iter().filter(|l| l.contains("write")).collect()
}

#[tokio::test(start_paused = true)]
async fn only_what_changed_is_written_and_everything_at_the_refresh() {
    let device = Device::new(Wire::Tcp);
    let mut bench = Bench::start(
        &device,
        vec![
            point("lamp", &[("coil", Integer(0))], Some(0)),
            point("horn", &[("coil", Integer(1))], Some(0)),
            point("setpoint", &[("holding-register", Integer(4)), ("type", text("f32"))], Some(0)),
            point("mode", &[("holding-register", Integer(9)), ("type", text("s16"))], Some(0)),
        ],
    );
    pass(20).await;
    assert_eq!(
        writes(&device),
        ["0ms write coils 0–1 [0, 0]", "2ms write holding registers 4–5 [0, 0]", "4ms write holding register 9 [0]"]
    );
    bench.demand(1, 1);
    bench.demand(2, u64::from(1.5f32.to_bits()));
    pass(400).await;
    assert_eq!(writes(&device), ["50ms write coil 1 [1]", "52ms write holding registers 4–5 [16320, 0]"]);
    bench.demand(3, 0xffff_fffe);
    pass(100).await;
    assert_eq!(writes(&device), ["450ms write holding register 9 [65534]"]);
    // A device that restarted has forgotten everything; the refresh tells it again.
    device.state().words.clear();
    pass(600).await;
    assert_eq!(
        writes(&device),
        [
            "1000ms write coils 0–1 [0, 1]",
            "1002ms write holding registers 4–5 [16320, 0]",
            "1004ms write holding register 9 [65534]"
        ]
    );
}

#[tokio::test(start_paused = true)]
async fn a_lane_that_does_not_run_makes_its_outputs_safe() {
    let device = Device::new(Wire::Tcp);
    let mut bench = Bench::start(&device, vec![point("valve", &[("coil", Integer(0))], Some(1))]);
    bench.demand(0, 0);
    pass(60).await;
    assert_eq!(device.word(Coil, 0), 0);
    bench.lane(false);
    pass(60).await;
    assert_eq!(device.word(Coil, 0), 1);
    bench.lane(true);
    pass(60).await;
    assert_eq!(device.word(Coil, 0), 0);
}

#[tokio::test(start_paused = true)]
async fn a_stop_writes_the_safe_values_and_leaves_the_inputs_bad() {
    for wire in [Wire::Tcp, Wire::Rtu] {
        let device = Device::new(wire);
        device.set(InputRegister, 0, &[77]);
        let mut bench = Bench::start(
            &device,
            vec![
                point("level", &[("input-register", Integer(0))], None),
                point("valve", &[("coil", Integer(0))], Some(1)),
                point("speed", &[("holding-register", Integer(0))], Some(25)),
            ],
        );
        bench.demand(1, 900);
        pass(500).await;
        assert_eq!((device.word(Coil, 0), device.word(HoldingRegister, 0)), (0, 900));
        assert!(bench.stop().await <= 10);
        assert_eq!((device.word(Coil, 0), device.word(HoldingRegister, 0)), (1, 25));
        assert_eq!(bench.input(0), (77, Quality::Bad));
        assert_eq!(bench.take_events().len(), 1, "only that it answers");
    }
}

/// Whatever the device does, the driver is gone after at most three timeouts of 100 ms (the request under way, the last
/// try to connect, the safe values), and says whose safe values may not have arrived.
#[tokio::test(start_paused = true)]
async fn a_stop_takes_bounded_time_and_tells_what_is_not_safe() {
    let mut told = Vec::new();
    for mood in [Mood::Absent, Mood::Silent, Mood::Closes, Mood::Garbage, Mood::WrongEcho] {
        for (wire, after) in [(Wire::Tcp, 10), (Wire::Tcp, 700), (Wire::Rtu, 300)] {
            let device = Device::new(wire);
            let outputs = vec![
                point("level", &[("input-register", Integer(0))], None),
                point("valve", &[("coil", Integer(0))], Some(1)),
                point("horn", &[("coil", Integer(8))], Some(0)),
            ];
            let mut bench = Bench::start(&device, outputs);
            pass(200).await;
            device.mood(mood);
            pass(after).await;
            bench.take_events();
            let took = bench.stop().await;
            assert!(took <= 310, "{mood:?} {wire:?}: {took} ms");
            let events = bench.take_events();
            let last = events.last().unwrap_or_else(|| panic!("{mood:?} {wire:?}: nothing was told"));
            assert!(last.contains("unsafe"), "{mood:?} {wire:?}: {last}");
            told.push(format!("{mood:?} {wire:?} after {after} ms: {last}"));
        }
    }
    insta::assert_snapshot!(told.join("\n"));
}

#[tokio::test(start_paused = true)]
async fn a_refused_output_harms_no_other_and_is_told_once() {
    let device = Device::new(Wire::Tcp);
    device.state().refused.insert((Coil, 1));
    let outputs = (0..3).map(|n| point(["a", "b", "c"][n], &[("coil", Integer(n as i64))], Some(0))).collect();
    let mut bench = Bench::start(&device, outputs);
    bench.demand(0, 1);
    bench.demand(1, 1);
    bench.demand(2, 1);
    pass(990).await;
    assert_eq!((device.word(Coil, 0), device.word(Coil, 2)), (1, 1));
    assert_eq!(
        writes(&device),
        ["0ms write coils 0–2 [1, 1, 1]", "2ms write coil 0 [1]", "4ms write coil 1 [1]", "6ms write coil 2 [1]"],
        "what is refused is not offered in every cycle"
    );
    pass(60).await;
    writes(&device);
    bench.demand(1, 0);
    pass(4900).await;
    assert_eq!(
        writes(&device).iter().filter(|l| l.contains("coil 1 ")).count(),
        5,
        "once for the change, four refreshes"
    );
    device.state().refused.clear();
    pass(1000).await;
    assert_eq!(bench.take_events().len(), 3);
    device.state().refused.insert((Coil, 1));
    bench.stop().await;
    insta::assert_snapshot!(bench.take_events().join("\n"));
}
