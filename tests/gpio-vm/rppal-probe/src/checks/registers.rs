//! Levels and outputs by the registers.

use crate::bench::{Lane, pin, same};
use crate::pi::{CLEAR, Pi, SET};
use latchwork_io::direct::Role;

pub(crate) fn levels(pi: &Pi) -> Result<(), String> {
    let mut lane = Lane::open(vec![
        pin("plain", 4, Role::Level).text("bias", "pull-up"),
        pin("inverted", 5, Role::Level).active_low(),
        pin("edge", 6, Role::Edge).active_low(),
    ])?;
    for high in [true, false, true] {
        for n in [4, 5, 6] {
            pi.set_level(n, high);
        }
        let found = [0, 1, 2].map(|n| lane.level(n));
        same(&format!("levels at {high}"), found, [Some(high), Some(!high), Some(!high)])?;
    }
    same("functions", [4, 5].map(|n| pi.function(n)), [0, 0])
}

pub(crate) fn outputs(pi: &Pi) -> Result<(), String> {
    let mut lane = Lane::open(vec![pin("plain", 22, Role::Output), pin("inverted", 23, Role::Output).active_low()])?;
    for register in [SET, CLEAR] {
        pi.written(register);
    }
    for (cells, set, clear) in [
        ([0, 0], None, None),
        ([1, 0], Some(22), None),
        ([1, 1], None, Some(23)),
        ([1, 1], None, None),
        ([0, 1], None, Some(22)),
        ([0, 0], Some(23), None),
    ] {
        lane.write(&cells);
        same(&format!("set and cleared by {cells:?}"), (pi.written(SET), pi.written(CLEAR)), (set, clear))?;
    }
    same("what was told", lane.told.len(), 0)
}

pub(crate) fn safe(pi: &Pi) -> Result<(), String> {
    for (safe, active_low) in [(false, false), (true, false), (false, true), (true, true)] {
        pi.set_function(24, 0);
        let mut point = pin("trip", 24, Role::Output).safe(safe);
        if active_low {
            point = point.active_low();
        }
        let case = format!("safe = {safe}, active-low = {active_low}");
        let expected = if safe != active_low { (Some(24), None) } else { (None, Some(24)) };
        let other = (expected.1, expected.0);
        for register in [SET, CLEAR] {
            pi.written(register);
        }
        let mut lane = Lane::open(vec![point])?;
        same(&format!("{case}, at the beginning"), (pi.written(SET), pi.written(CLEAR)), expected)?;
        same(&format!("{case}, function"), pi.function(24), 1)?;
        lane.write(&[u64::from(!safe)]);
        same(&format!("{case}, live"), (pi.written(SET), pi.written(CLEAR)), other)?;
        drop(lane);
        same(&format!("{case}, at the end"), (pi.written(SET), pi.written(CLEAR)), expected)?;
        same(&format!("{case}, function at the end"), pi.function(24), 1)?;
    }
    // A panic in the lane is a way out, too.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let mut lane = Lane::open(vec![pin("trip", 24, Role::Output)])?;
    lane.write(&[1]);
    pi.written(CLEAR);
    let thread = std::thread::spawn(move || {
        let _lane = lane;
        panic!("the lane ends");
    });
    let ended = thread.join().is_err();
    std::panic::set_hook(hook);
    same("the lane panicked and its output was cleared", (ended, pi.written(CLEAR)), (true, Some(24)))
}
