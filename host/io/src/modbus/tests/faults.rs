//! A peer that is away, dies, comes back or talks nonsense.

use super::super::point::Table::*;
use super::bench::{Bench, TIMING, pass, point};
use super::device::{Device, Mood, Wire};
use crate::driver::PointConfig;
use latchwork_image::Quality;
use latchwork_schema::Value::Integer;
use proptest::prelude::*;

const ALL: [Mood; 13] = [
    Mood::Absent,
    Mood::Silent,
    Mood::Late(150),
    Mood::Closes,
    Mood::WrongTransaction,
    Mood::WrongUnit,
    Mood::WrongFunction,
    Mood::WrongCount,
    Mood::WrongEcho,
    Mood::Garbage,
    Mood::Partial,
    Mood::Twice,
    Mood::BadChecksum,
];

fn points() -> Vec<PointConfig> {
    vec![
        point("level", &[("input-register", Integer(0))], None),
        point("door", &[("discrete-input", Integer(0))], None),
        point("lamp", &[("coil", Integer(0))], Some(0)),
    ]
}

/// What a wire can show: a serial line has no transactions and a TCP frame has no checksum.
fn possible(wire: Wire, mood: Mood) -> bool {
    !matches!((wire, mood), (Wire::Rtu, Mood::WrongTransaction) | (Wire::Tcp, Mood::BadChecksum))
}

#[tokio::test(start_paused = true)]
async fn every_fault_makes_the_inputs_bad_is_told_once_and_ends() {
    let mut told = Vec::new();
    for wire in [Wire::Tcp, Wire::Rtu] {
        for mood in ALL.into_iter().filter(|m| possible(wire, *m)) {
            let device = Device::new(wire);
            device.set(InputRegister, 0, &[1234]);
            let bench = Bench::start(&device, points());
            pass(990).await;
            assert_eq!(bench.input(0), (1234, Quality::Good));
            bench.take_events();
            device.mood(mood);
            pass(30_000).await;
            let (value, quality) = bench.input(0);
            assert_eq!(bench.take_events().len(), 1, "{wire:?} {mood:?}");
            assert_eq!((value, quality), (1234, Quality::Bad), "{wire:?} {mood:?}");
            device.mood(Mood::Fine);
            pass(TIMING.reconnect_max.as_millis() as u64 + 500).await;
            assert_eq!(bench.input(0), (1234, Quality::Good), "{wire:?} {mood:?}");
            let after = bench.take_events();
            assert!(after.last().unwrap().contains("connected"), "{wire:?} {mood:?}: {after:?}");
            pass(5000).await;
            assert_eq!(bench.take_events(), Vec::<String>::new(), "{wire:?} {mood:?}");
            assert_eq!(bench.input(0), (1234, Quality::Good));
            told.push((wire, mood));
        }
    }
    assert_eq!(told.len(), 2 * ALL.len() - 2);
}

#[tokio::test(start_paused = true)]
async fn messages_of_faults() {
    let mut told = Vec::new();
    for (wire, mood) in ALL.into_iter().map(|m| (Wire::Tcp, m)).chain([
        (Wire::Rtu, Mood::BadChecksum),
        (Wire::Rtu, Mood::Garbage),
        (Wire::Rtu, Mood::Twice),
    ]) {
        let device = Device::new(wire);
        let bench = Bench::start(&device, points());
        pass(990).await;
        bench.take_events();
        device.mood(mood);
        pass(3000).await;
        device.mood(Mood::Fine);
        pass(3000).await;
        let events = bench.take_events();
        let shown = [events.first(), events.last()].into_iter().flatten().map(|e| format!("  {e}")).collect::<Vec<_>>();
        told.push(format!("{wire:?} {mood:?}\n{}", shown.join("\n")));
    }
    insta::assert_snapshot!(told.join("\n"));
}

#[tokio::test(start_paused = true)]
async fn a_peer_absent_at_start_is_waited_for_with_growing_pauses() {
    let device = Device::new(Wire::Tcp);
    device.mood(Mood::Absent);
    let bench = Bench::start(&device, points());
    pass(10_000).await;
    assert_eq!(device.state().connects, [0, 250, 750, 1750, 3750, 5750, 7750, 9750]);
    assert_eq!(bench.input(0), (0, Quality::Bad));
    device.mood(Mood::Fine);
    pass(2000).await;
    assert_eq!(bench.input(0).1, Quality::Good);
    insta::assert_snapshot!(bench.take_events().join("\n"));
}

#[tokio::test(start_paused = true)]
async fn a_peer_that_comes_and_goes_floods_nothing() {
    for mood in [Mood::Closes, Mood::WrongEcho] {
        let device = Device::new(Wire::Rtu);
        let bench = Bench::start(&device, points());
        for _ in 0..200 {
            device.mood(Mood::Fine);
            pass(200).await;
            device.mood(mood);
            pass(100).await;
        }
        // One minute; the longest pause is 2 s, so at most one outage (two events) in that time.
        let events = bench.take_events().len();
        assert!(events <= 2 * 30 + 10, "{mood:?}: {events} events in a minute");
        assert!(device.state().connects.len() <= 40);
    }
}

#[tokio::test(start_paused = true)]
async fn a_link_that_has_held_begins_with_the_shortest_pause() {
    let device = Device::new(Wire::Tcp);
    let _bench = Bench::start(&device, points());
    for _ in 0..3 {
        pass(3000).await;
        device.state().connects.clear();
        device.mood(Mood::Closes);
        pass(60).await;
        device.mood(Mood::Fine);
        pass(300).await;
        assert_eq!(device.state().connects.len(), 1);
    }
}

/// Every answer carries the number of the reading it belongs to; whatever was late or doubled, a value that is published
/// as good is that of the latest reading.
async fn nothing_stale_passes_for_fresh(wire: Wire, points: Vec<PointConfig>, moods: &[(Mood, u64)]) {
    let device = Device::new(wire);
    device.state().counter = Some(0);
    let bench = Bench::start(&device, points);
    let mut publications = 0;
    for (mood, ms) in moods.iter().copied().chain([(Mood::Fine, 4000)]) {
        device.mood(mood);
        for _ in 0..ms {
            let asked = device.state().counter.unwrap();
            pass(1).await;
            let (value, quality) = bench.input(0);
            let fresh = bench.inputs.publications() != publications;
            publications = bench.inputs.publications();
            if fresh && quality == Quality::Good {
                // The next one may have been asked in this very millisecond.
                assert!(value >= u64::from(asked), "{wire:?} {moods:?}: good {value} after reading {asked}");
            }
        }
    }
    assert_eq!(bench.input(0).1, Quality::Good, "{wire:?} {moods:?}: it recovers");
}

#[tokio::test(start_paused = true)]
async fn late_answers_are_never_taken_for_new_ones() {
    for wire in [Wire::Tcp, Wire::Rtu] {
        for late in (90..420).step_by(11) {
            // One request alone: every answer looks like every other.
            for points in [points(), points()[..1].to_vec()] {
                nothing_stale_passes_for_fresh(wire, points, &[(Mood::Fine, 300), (Mood::Late(late), 1500)]).await;
            }
        }
        nothing_stale_passes_for_fresh(wire, points()[..1].to_vec(), &[(Mood::Fine, 300), (Mood::Twice, 600)]).await;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn no_sequence_of_faults_makes_stale_values_good(
        rtu: bool,
        moods in prop::collection::vec((prop::sample::select(ALL.to_vec()), 1..700u64), 1..6),
        late in 0..430u64,
        one: bool,
    ) {
        let wire = if rtu { Wire::Rtu } else { Wire::Tcp };
        let moods: Vec<_> = moods
            .into_iter()
            .map(|(mood, ms)| (if matches!(mood, Mood::Late(_)) { Mood::Late(late) } else { mood }, ms))
            .filter(|(mood, _)| possible(wire, *mood))
            // A second answer during the next equal question on a serial line is beyond anybody's knowing.
            .filter(|(mood, _)| !(rtu && one && *mood == Mood::Twice))
            .collect();
        let points = if one { points()[..1].to_vec() } else { points() };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build().unwrap();
        runtime.block_on(nothing_stale_passes_for_fresh(wire, points, &moods));
    }
}
