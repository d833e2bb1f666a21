//! What may stand in the way, and that it is told once.

use crate::bench::{Lane, pin, same, told};
use crate::pi::{HELD, HOLDER, Pi, pretend};
use latchwork_io::direct::Role;

fn points() -> Vec<crate::bench::Point> {
    vec![pin("door", 17, Role::Edge), pin("level", 18, Role::Level), pin("trip", 27, Role::Output)]
}

pub(crate) fn no_board() -> Result<(), String> {
    let mut lane = Lane::closed(points())?;
    lane.try_open();
    lane.try_open();
    same("it is healthy", lane.direct.healthy(), false)?;
    same("events", lane.told.len(), 1)?;
    told(&lane.told, "pi refused", &["no Raspberry Pi", "kind = \"gpio\""])
}

/// The machine gets a board without a chip, then the chip.
pub(crate) fn board_comes() -> Result<Pi, String> {
    pretend()?;
    let mut lane = Lane::closed(points())?;
    lane.try_open();
    lane.try_open();
    same("events without a chip", lane.told.len(), 1)?;
    told(&lane.told, "pi refused", &["/dev/gpiochip"])?;
    let pi = Pi::new()?;
    lane.try_open();
    same("events with a chip", lane.told.len(), 2)?;
    told(&lane.told, "pi accepted", &[])?;
    same("it is healthy", lane.direct.healthy(), true)?;
    Ok(pi)
}

pub(crate) fn held(_: &Pi) -> Result<(), String> {
    for role in [Role::Edge, Role::Level, Role::Output] {
        let mut lane = Lane::closed(vec![pin("ours", 17, Role::Edge), pin("theirs", HELD, role)])?;
        lane.try_open();
        lane.try_open();
        same("events", lane.told.len(), 1)?;
        told(&lane.told, "pi.theirs refused", &[HOLDER, "GPIO11"])?;
        same("the other point is good", [0, 1].map(|n| lane.direct.good(n)), [true, false])?;
        same("it is healthy", lane.direct.healthy(), false)?;
    }
    Ok(())
}

pub(crate) fn peripheral(pi: &Pi) -> Result<(), String> {
    pi.set_function(14, 4);
    let mut lane = Lane::closed(vec![pin("serial", 14, Role::Output)])?;
    lane.try_open();
    let function = pi.function(14);
    pi.set_function(14, 0);
    told(&lane.told, "pi.serial refused", &["Alt0", "config.txt"])?;
    same("its function", function, 4)
}

pub(crate) fn taken(_: &Pi) -> Result<(), String> {
    for role in [Role::Edge, Role::Level, Role::Output] {
        let first = Lane::open(vec![pin("a", 17, role)])?;
        let mut second = Lane::closed(vec![pin("b", 17, Role::Level)])?;
        second.try_open();
        second.try_open();
        same("events", second.told.len(), 1)?;
        told(&second.told, "pi.b refused", &["GPIO17", "one pin, one driver"])?;
        drop(first);
        second.try_open();
        told(&second.told, "pi.b accepted", &[])?;
    }
    Ok(())
}
