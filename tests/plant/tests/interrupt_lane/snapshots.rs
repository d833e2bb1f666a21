//! Two real threads: a cyclic lane sees the outputs of an interrupt lane as one snapshot, never the effect before the cause.

use super::*;
use latchwork_plant::assemble::Time;
use latchwork_plant::model::TagRef;
use latchwork_plant::run::resolve_stimulus;
use std::sync::atomic::{AtomicBool, Ordering};

#[test]
fn a_scan_sees_one_snapshot_of_the_interrupt_lane() {
    let rest = "[block.again]\ncomponent = \"interlock-probe\"\nlane = \"main\"\n\
                inputs = { a = \"gpio.door\", b = \"fast.outputs.a\", c = \"gpio.dump\" }";
    let rig = plant("", "storm-limit = 1000000", rest).trace(None);
    let mut plant = rig.plant(Time::Virtual);
    let rows = b"time,tag,value\n0ms,gpio.door,true\n0ms,gpio.door,false\n";
    let rows = latchwork_io::stimulus::read(&rows[..]).unwrap();
    let stimulus = resolve_stimulus(&plant, &rows).unwrap();
    let port = |name: &str, block: usize| {
        let class = &plant.model.blocks[block].class;
        let port = class.outputs.iter().position(|p| p.path == name).unwrap();
        plant.layout.ids[&TagRef::Output { block, port }]
    };
    // The door itself and what the interlock made of it, through two blocks of the cyclic lane.
    let mut seen = plant.view(&[port("b", 1), port("a", 2), port("b", 2)]);
    let mut trip = plant.lanes.remove(1);
    let mut main = plant.lanes.remove(0);
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            trip.begin_interrupts(0);
            for n in 0u64.. {
                if done.load(Ordering::Relaxed) {
                    break;
                }
                // Far enough apart that nobody takes it for a storm.
                let now = n * 10_000;
                plant.stimulate(&stimulus[(n % 2) as usize].action, now);
                trip.collect();
                while let Some(arrival) = trip.next_arrival(u64::MAX) {
                    trip.activate(arrival, now, || now);
                }
            }
        });
        let (mut scans, mut changes, mut last) = (0u64, 0u64, 0);
        // Until the lanes have run against each other often enough to tell.
        while changes < 10_000 {
            main.scan(scans, scans, || scans);
            seen.refresh();
            let (door, again, output) = (seen.cell(0), seen.cell(1), seen.cell(2));
            if (door, door) != (again, output) {
                done.store(true, Ordering::Relaxed);
                panic!("scan {scans}: two readers, or cause and effect, differ: {door} {again} {output}");
            }
            changes += u64::from(door != last);
            last = door;
            scans += 1;
        }
        done.store(true, Ordering::Relaxed);
    });
}
