//! Edges and chips that are lost.

use crate::bench::{Lane, pin, same, told};
use crate::pi::Pi;
use latchwork_io::direct::Role;

pub(crate) fn overflow(pi: &Pi) -> Result<(), String> {
    const PULLED: u64 = 1500;
    const KEPT: usize = 1024;
    pi.pull(17, false);
    let mut lane = Lane::open(vec![pin("door", 17, Role::Edge)])?;
    for n in 0..PULLED {
        pi.pull(17, n % 2 == 0);
    }
    let mut edges = Vec::new();
    lane.take(0, &mut edges);
    same("edges kept", edges.len(), KEPT)?;
    pi.pull(17, true);
    lane.next(0, &mut edges)?;
    let missed: u64 = edges.iter().map(|e| e.missed).sum();
    same("edges lost", missed, PULLED - KEPT as u64)?;
    same("places of a gap", edges.iter().filter(|e| e.missed > 0).count(), 1)
}

pub(crate) fn unplugged(pi: &Pi) -> Result<(), String> {
    pi.pull(17, false);
    let mut other = Lane::open(vec![pin("gate", 18, Role::Edge)])?;
    let mut lane = Lane::open(vec![pin("door", 17, Role::Edge), pin("trip", 27, Role::Output)])?;
    pi.unplug()?;
    let mut edges = Vec::new();
    let seen = lane.wait(0);
    lane.take(0, &mut edges);
    lane.try_open();
    lane.try_open();
    let (good, healthy) = (lane.direct.good(0), lane.direct.healthy());
    pi.plug()?;
    same("its descriptor tells", seen, true)?;
    same("it is good, and all is healthy", (good, healthy), (false, false))?;
    told(&lane.told, "pi.door lost", &["edges"])?;
    told(&lane.told, "pi refused", &["/dev/gpiochip"])?;
    same("the output works on", lane.direct.good(1), true)?;
    lane.try_open();
    told(&lane.told, "pi.door accepted", &[])?;
    same("it is healthy", lane.direct.healthy(), true)?;
    pi.pull(17, true);
    lane.next(0, &mut edges)?;
    same("edges", edges.iter().map(|e| (e.level, e.missed)).collect::<Vec<_>>(), vec![(true, 0)])?;
    // A lane of edges alone has no output that kept the registers.
    drop(lane);
    other.take(0, &mut edges);
    same("the other lane is healthy", other.direct.healthy(), false)?;
    other.try_open();
    told(&other.told, "pi.gate accepted", &[])
}
