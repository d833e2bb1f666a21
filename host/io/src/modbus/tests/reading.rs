//! Reading: values, schedule, requests.

use super::super::point::Table::*;
use super::bench::{Bench, TIMING, pass, point, text};
use super::device::{Device, Mood, Wire};
use latchwork_image::Quality;
use latchwork_schema::Value::Integer;

#[tokio::test(start_paused = true)]
async fn values_of_all_tables_come_good_and_in_few_requests() {
    for wire in [Wire::Tcp, Wire::Rtu] {
        let device = Device::new(wire);
        device.set(InputRegister, 0, &[0xfffe, 0x4148, 0x0000]);
        device.set(HoldingRegister, 8, &[0x5678, 0x1234]);
        device.set(DiscreteInput, 9, &[1]);
        device.set(Coil, 3, &[1]);
        device.set(InputRegister, 90, &[0x8000]);
        let bench = Bench::start(
            &device,
            vec![
                point("speed", &[("input-register", Integer(0)), ("type", text("s16"))], None),
                point("flow", &[("input-register", Integer(1)), ("type", text("f32"))], None),
                point(
                    "hours",
                    &[("holding-register", Integer(8)), ("type", text("u32")), ("words", text("little"))],
                    None,
                ),
                point("door", &[("discrete-input", Integer(9))], None),
                point("closed", &[("discrete-input", Integer(10))], None),
                point("lamp", &[("coil", Integer(3))], None),
                point("fault", &[("input-register", Integer(90)), ("bit", Integer(15))], None),
            ],
        );
        assert_eq!(bench.input(0), (0, Quality::Bad), "before the first cycle");
        pass(720).await;
        let expected = [0xffff_fffe, u64::from(12.5f32.to_bits()), 0x1234_5678, 1, 0, 1, 1];
        for (n, cell) in expected.into_iter().enumerate() {
            assert_eq!(bench.input(n as u32), (cell, Quality::Good), "{wire:?} point {n}");
        }
        let log = device.take_log();
        let first: Vec<&str> = log[..5].iter().map(|l| l.split_once(' ').unwrap().1).collect();
        assert_eq!(
            first,
            [
                "read discrete inputs 9–10",
                "read coil 3",
                "read input registers 0–2",
                "read input register 90",
                "read holding registers 8–9"
            ]
        );
    }
}

#[tokio::test(start_paused = true)]
async fn the_grid_of_the_schedule_stays_and_missed_cycles_are_left_out() {
    let device = Device::new(Wire::Tcp);
    let bench = Bench::start(&device, vec![point("a", &[("coil", Integer(0))], None)]);
    let times =
        |log: Vec<String>| log.iter().map(|l| l.split_once("ms").unwrap().0.parse().unwrap()).collect::<Vec<u64>>();
    pass(10_010).await;
    assert_eq!(times(device.take_log()), (0..=200).map(|n| n * 50).collect::<Vec<_>>());
    // 60 ms and the ordinary 2: each cycle misses the next tick, and none is made up for.
    device.mood(Mood::Late(60));
    pass(500).await;
    device.mood(Mood::Fine);
    let slow = times(device.take_log());
    assert!(slow.iter().all(|t| t % 50 == 0 || slow.contains(&(t - 62))), "{slow:?}");
    assert!(slow.len() <= 500 / 62 + 1, "{slow:?}");
    assert_eq!(bench.take_events().len(), 1, "a slow device is no fault");
}

#[tokio::test(start_paused = true)]
async fn a_cycle_is_one_snapshot_with_its_time() {
    let device = Device::new(Wire::Tcp);
    let bench = Bench::start(
        &device,
        vec![point("a", &[("coil", Integer(0))], None), point("b", &[("input-register", Integer(0))], None)],
    );
    pass(1).await;
    let before = bench.inputs.publications();
    pass(TIMING.every.as_millis() as u64 * 10).await;
    assert_eq!(bench.inputs.publications() - before, 10);
    let mut cells = [0; 4];
    assert_eq!(bench.inputs.copy_to(&mut cells), 454_000_000, "the end of the last reading");
}

#[tokio::test(start_paused = true)]
async fn a_refused_range_turns_bad_alone_and_is_told_once() {
    let device = Device::new(Wire::Tcp);
    device.set(InputRegister, 0, &[5]);
    device.set(InputRegister, 20, &[6]);
    device.state().refused.insert((InputRegister, 11));
    let bench = Bench::start(
        &device,
        vec![
            point("good", &[("input-register", Integer(0))], None),
            point("ten", &[("input-register", Integer(10))], None),
            point("eleven", &[("input-register", Integer(11))], None),
            point("alone", &[("input-register", Integer(20))], None),
        ],
    );
    pass(1010).await;
    assert_eq!(bench.input(0), (5, Quality::Good));
    assert_eq!((bench.input(1).1, bench.input(2).1), (Quality::Bad, Quality::Bad));
    assert_eq!(bench.input(3), (6, Quality::Good));
    {
        let mut state = device.state();
        state.refused = [(InputRegister, 20)].into();
        state.exception = 6;
    }
    pass(1000).await;
    assert_eq!((bench.input(1).1, bench.input(2).1), (Quality::Good, Quality::Good));
    assert_eq!(bench.input(3), (6, Quality::Bad), "the last value is kept");
    device.state().refused.clear();
    pass(1000).await;
    assert_eq!(bench.input(3), (6, Quality::Good));
    insta::assert_snapshot!(bench.take_events().join("\n"));
}
