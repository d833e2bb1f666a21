//! Edges and their stamps.

use crate::bench::{Lane, pin, same};
use crate::pi::Pi;
use latchwork_io::direct::{Edge, Role};
use latchwork_schema::Value;
use std::time::Duration;

/// What came: level and loss of each edge.
fn levels(edges: &[Edge]) -> Vec<(bool, u64)> {
    edges.iter().map(|e| (e.level, e.missed)).collect()
}

pub(crate) fn several(pi: &Pi) -> Result<(), String> {
    const PINS: [u8; 4] = [4, 17, 22, 27];
    const ROUNDS: usize = 500;
    PINS.iter().for_each(|p| pi.pull(*p, false));
    let names = ["a", "b", "c", "d"];
    let mut lane = Lane::open(names.iter().zip(PINS).map(|(n, p)| pin(n, p, Role::Edge)).collect())?;
    let mut edges = Vec::new();
    for round in 0..ROUNDS {
        for (point, p) in PINS.iter().enumerate() {
            pi.pull(*p, round % 2 == 0);
            // Not all at once: several of one line wait together then, and are read in one batch.
            if round % 7 == 0 {
                lane.next(point, &mut edges)?;
            }
        }
    }
    for point in 0..PINS.len() {
        lane.take(point, &mut edges);
    }
    for (point, p) in PINS.iter().enumerate() {
        let own: Vec<Edge> = edges.iter().filter(|e| e.point == point).copied().collect();
        let expected: Vec<(bool, u64)> = (0..ROUNDS).map(|r| (r % 2 == 0, 0)).collect();
        same(&format!("number of edges of pin {p}"), own.len(), ROUNDS)?;
        same(&format!("edges of pin {p}"), levels(&own) == expected, true)?;
        same("stamps rise", own.windows(2).all(|w| w[0].at < w[1].at), true)?;
    }
    // Over all pins the stamps give the order in which they were pulled.
    edges.sort_by_key(|e| e.at);
    same("order of the pins", edges.iter().enumerate().all(|(n, e)| e.point == n % PINS.len()), true)?;
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    let now = Duration::new(now.tv_sec.unsigned_abs(), now.tv_nsec as u32).as_nanos() as u64;
    let last = edges.last().map_or(0, |e| e.at);
    same("the last stamp is of this minute", last <= now && now - last < 60_000_000_000, true)
}

pub(crate) fn single(pi: &Pi) -> Result<(), String> {
    for (edge, levels_of) in [("rising", true), ("falling", false)] {
        pi.pull(17, false);
        let mut lane = Lane::open(vec![pin("door", 17, Role::Edge).text("edge", edge)])?;
        let mut edges = Vec::new();
        for _ in 0..20 {
            pi.pull(17, true);
            pi.pull(17, false);
            lane.next(0, &mut edges)?;
        }
        same(edge, levels(&edges), vec![(levels_of, 0); 20])?;
    }
    Ok(())
}

pub(crate) fn active_low(pi: &Pi) -> Result<(), String> {
    pi.pull(17, true);
    let mut lane = Lane::open(vec![pin("door", 17, Role::Edge).active_low()])?;
    let mut edges = Vec::new();
    for high in [false, true, false] {
        pi.pull(17, high);
        lane.next(0, &mut edges)?;
    }
    same("levels", levels(&edges), vec![(true, 0), (false, 0), (true, 0)])?;
    drop(lane);
    pi.pull(17, true);
    let mut lane = Lane::open(vec![pin("door", 17, Role::Edge).active_low().text("edge", "rising")])?;
    let mut edges = Vec::new();
    for high in [false, true, false] {
        pi.pull(17, high);
    }
    lane.next(0, &mut edges)?;
    same("rising edges of the value", levels(&edges), vec![(true, 0), (true, 0)])
}

pub(crate) fn debounced(pi: &Pi) -> Result<(), String> {
    const TIME: Duration = Duration::from_millis(100);
    pi.pull(17, false);
    pi.pull(18, false);
    let time = || Value::Duration(TIME.as_nanos() as u64);
    let mut lane = Lane::open(vec![
        pin("door", 17, Role::Edge).with("debounce", time()),
        pin("gate", 18, Role::Level).active_low().with("debounce", time()),
    ])?;
    same("levels at first", [lane.level(0), lane.level(1)], [Some(false), Some(true)])?;
    let mut edges = Vec::new();
    for n in 0..6 {
        pi.pull(17, n % 2 == 0);
        pi.pull(18, n % 2 == 0);
    }
    // It waits for the kernel, which counts the time; nothing else tells that no edge comes.
    std::thread::sleep(3 * TIME);
    lane.take(0, &mut edges);
    same("edges of a bounce", levels(&edges), vec![])?;
    same("levels after it", [lane.level(0), lane.level(1)], [Some(false), Some(true)])?;
    pi.pull(17, true);
    pi.pull(18, true);
    lane.next(0, &mut edges)?;
    same("edges of what holds", levels(&edges), vec![(true, 0)])?;
    std::thread::sleep(TIME);
    same("levels of what holds", [lane.level(0), lane.level(1)], [Some(true), Some(false)])
}
