//! The driver on the I/O thread.

use crate::bench::{config, kind, pin, render, same};
use crate::pi::{CLEAR, Pi, SET};
use latchwork_image::{Location, Quality, RegionReader, Resolved, View, region};
use latchwork_io::IoThread;
use latchwork_io::direct::Role;
use latchwork_io::driver::{DriverContext, Outputs};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// State of a lane that has stopped.
const STOPPED: u64 = 2;
const BAD: u64 = Quality::Bad as u64;

pub(crate) fn driver(pi: &Pi) -> Result<(), String> {
    let good = Quality::Good.cell();
    let points = vec![
        pin("door", 5, Role::Level),
        pin("gate", 6, Role::Level).active_low(),
        pin("trip", 24, Role::Output).safe(true),
    ];
    pi.set_level(5, true);
    pi.set_level(6, true);
    let (config, _) = config(points);
    let built = (kind().build)(config)?;
    let (writer, inputs) = region(&[0, BAD, 0, BAD]);
    let (mut demands, demanded) = region(&[0, 0]);
    let at = |slot| Resolved::Cell { location: Location { region: 0, slot, bit: None, quality: None }, not: false };
    let outputs = Outputs::new(View::new(&[demanded], &[at(0), at(1)]));
    let told = Arc::new(Mutex::new(Vec::new()));
    let kept = Arc::clone(&told);
    let context = move |stop| DriverContext {
        inputs: writer,
        outputs,
        clock: Arc::new(|| 0),
        report: Box::new(move |e| kept.lock().unwrap_or_else(|e| e.into_inner()).push(render(&e))),
        stop,
    };
    for register in [SET, CLEAR] {
        pi.written(register);
    }
    let thread = IoThread::start(vec![move |stop| (built, context(stop))]);
    until(&inputs, [1, good, 0, good])?;
    same("safe at the beginning", (pi.written(SET), pi.written(CLEAR)), (Some(24), None))?;
    demands.publish(&[0, Outputs::RUNNING], 0);
    pi.set_level(5, false);
    pi.set_level(6, false);
    until(&inputs, [0, good, 1, good])?;
    let written = |register| wait(|| pi.written(register) == Some(24), || format!("nothing written to {register:#x}"));
    written(CLEAR)?;
    demands.publish(&[0, STOPPED], 0);
    written(SET)?;
    demands.publish(&[0, Outputs::RUNNING], 0);
    written(CLEAR)?;
    same("it stops in time", thread.stop(Duration::from_secs(2)), true)?;
    same("safe at the stop", (pi.written(SET), pi.written(CLEAR)), (Some(24), None))?;
    same("inputs after the stop", [0, 1, 2, 3].map(|n| inputs.cell(n)), [0, BAD, 1, BAD])?;
    let told = told.lock().unwrap_or_else(|e| e.into_inner());
    same("what was told", told.len(), 0)
}

/// Waits until the inputs are so.
fn until(inputs: &RegionReader, cells: [u64; 4]) -> Result<(), String> {
    let now = || [0, 1, 2, 3].map(|n| inputs.cell(n));
    wait(|| now() == cells, || format!("inputs are {:?}, expected {cells:?}", now()))
}

fn wait(done: impl Fn() -> bool, why: impl Fn() -> String) -> Result<(), String> {
    let begin = Instant::now();
    while !done() {
        if begin.elapsed() > Duration::from_secs(5) {
            return Err(why());
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(())
}
