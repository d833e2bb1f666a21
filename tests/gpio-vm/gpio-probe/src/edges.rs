//! Inputs of an interrupt lane.

use crate::bench::{Keys, Lane, number, point, text, wait};
use crate::chip::Chip;
use crate::{Outcome, ensure};
use latchwork_io::direct::{Edge, Role};
use latchwork_io::driver::PointConfig;
use latchwork_schema::Value::{Bool, Duration as Span};
use rustix::event::PollFlags;
use rustix::time::{ClockId, clock_gettime};
use std::time::Duration;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// A point whose edges are taken.
fn edge(name: &str, line: usize, keys: Keys<'_>) -> (PointConfig, Role) {
    let keys: Vec<_> = [("line", number(line))].into_iter().chain(keys.iter().cloned()).collect();
    (point(name, &keys, None), Role::Edge)
}

fn now() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

/// Edges are whole: rising stamps, none missed, levels in turn beginning with `first`.
fn whole(edges: &[Edge], first: bool) -> Outcome {
    for (n, edge) in edges.iter().enumerate() {
        ensure!(edge.missed == 0, "edge {n} of point {} tells of {} missed ones", edge.point, edge.missed);
        ensure!(edge.level == (first == (n % 2 == 0)), "edge {n} of point {} has level {}", edge.point, edge.level);
    }
    let rising = edges.windows(2).all(|p| p[0].at <= p[1].at);
    ensure!(rising, "the stamps of point {} do not rise", edges[0].point);
    Ok(())
}

pub(crate) fn several_lines() -> Outcome {
    const LINES: usize = 6;
    const PULLS: usize = 2400;
    let chip = Chip::new("several", 8, &[])?;
    let points = (0..LINES).map(|n| edge(["a", "b", "c", "d", "e", "f"][n], n, &[])).collect();
    let mut lane = Lane::healthy(&chip, points)?;
    let begin = now();
    let mut taken: Vec<Vec<Edge>> = vec![Vec::new(); LINES];
    std::thread::scope(|scope| {
        // One hand pulls while the other takes.
        let pulling = scope.spawn(|| (0..PULLS).for_each(|n| chip.pull(n % LINES, (n / LINES).is_multiple_of(2))));
        while !pulling.is_finished() {
            taken.iter_mut().enumerate().for_each(|(n, t)| t.extend(lane.edges(n)));
        }
    });
    taken.iter_mut().enumerate().for_each(|(n, t)| t.extend(lane.edges(n)));
    let end = now();
    for (n, edges) in taken.iter().enumerate() {
        ensure!(edges.len() == PULLS / LINES, "point {n} saw {} edges of {}", edges.len(), PULLS / LINES);
        ensure!(edges.iter().all(|e| e.point == n && (begin..=end).contains(&e.at)), "stamps of point {n} are off");
        whole(edges, true)?;
    }
    let mut all: Vec<Edge> = taken.into_iter().flatten().collect();
    all.sort_by_key(|e| e.at);
    // The stamps put the edges of all lines into the order in which they were pulled.
    ensure!(
        all.iter().enumerate().all(|(n, e)| e.point == n % LINES),
        "the order of the lines' edges is not that of the pulls"
    );
    ensure!(lane.events.is_empty(), "there were events: {:?}", lane.told());
    Ok(())
}

pub(crate) fn bursts() -> Outcome {
    let chip = Chip::new("bursts", 2, &[])?;
    let mut lane = Lane::healthy(&chip, vec![edge("a", 0, &[])])?;
    // More than a batch, less than the kernel keeps: a library that takes several and hands on one would lose them.
    for burst in [1, 2, 7, 8, 9, 63, 64, 65, 128, 1024] {
        (0..burst).for_each(|n| chip.pull(0, n % 2 == 0));
        let edges = lane.edges(0);
        ensure!(edges.len() == burst, "{} edges of a burst of {burst}", edges.len());
        whole(&edges, true)?;
        if burst % 2 == 1 {
            chip.pull(0, false);
            ensure!(lane.edges(0).len() == 1, "the line came back without an edge");
        }
    }
    ensure!(lane.edges(0).is_empty(), "edges of nothing");
    Ok(())
}

pub(crate) fn kinds() -> Outcome {
    let chip = Chip::new("kinds", 3, &[])?;
    let points = ["both", "rising", "falling"].iter().enumerate();
    let mut lane = Lane::healthy(&chip, points.map(|(n, e)| edge(e, n, &[("edge", text(e))])).collect())?;
    for _ in 0..5 {
        for up in [true, false] {
            (0..3).for_each(|line| chip.pull(line, up));
        }
    }
    let taken: Vec<Vec<bool>> = (0..3).map(|n| lane.edges(n).iter().map(|e| e.level).collect()).collect();
    ensure!(taken[0] == [true, false].repeat(5), "both: {:?}", taken[0]);
    ensure!(taken[1] == [true; 5], "rising: {:?}", taken[1]);
    ensure!(taken[2] == [false; 5], "falling: {:?}", taken[2]);
    Ok(())
}

pub(crate) fn active_low() -> Outcome {
    let chip = Chip::new("low", 2, &[])?;
    chip.pull(0, true);
    chip.pull(1, true);
    let low = ("active-low", Bool(true));
    let points =
        vec![edge("both", 0, std::slice::from_ref(&low)), edge("one", 1, &[low.clone(), ("edge", text("rising"))])];
    let mut lane = Lane::healthy(&chip, points)?;
    ensure!(lane.level(0) == Some(false), "a high line is {:?}", lane.level(0));
    for up in [false, true, false] {
        chip.pull(0, up);
        chip.pull(1, up);
    }
    let levels: Vec<bool> = lane.edges(0).iter().map(|e| e.level).collect();
    ensure!(levels == [true, false, true], "levels after the edges: {levels:?}");
    ensure!(lane.level(0) == Some(true), "a low line is {:?}", lane.level(0));
    let levels: Vec<bool> = lane.edges(1).iter().map(|e| e.level).collect();
    ensure!(levels == [true, true], "rising edges of an active-low line: {levels:?}");
    Ok(())
}

pub(crate) fn wake() -> Outcome {
    let chip = Chip::new("wake", 2, &[])?;
    let mut lane = Lane::healthy(&chip, vec![edge("a", 0, &[]), edge("b", 1, &[])])?;
    let ready = |lane: &Lane, n: usize, ms| {
        let descriptor = lane.direct.descriptor(n).expect("it is open");
        wait(descriptor, Duration::from_millis(ms)).contains(PollFlags::IN)
    };
    ensure!(!ready(&lane, 0, 20), "readable without an edge");
    chip.pull(1, true);
    ensure!(ready(&lane, 1, 1000) && !ready(&lane, 0, 0), "the wrong line is readable");
    ensure!(lane.edges(1).len() == 1 && !ready(&lane, 1, 0), "still readable when all was taken");
    Ok(())
}

/// `pulls` edges into a buffer of `kept`: the oldest are missed, all are accounted for.
fn overflow(lane: &mut Lane, chip: &Chip, pulls: u64, kept: u64) -> Outcome {
    (0..pulls).for_each(|n| chip.pull(0, n % 2 == 0));
    let edges = lane.edges(0);
    let missed: Vec<u64> = edges.iter().map(|e| e.missed).collect();
    ensure!(edges.len() as u64 == kept, "{} edges were kept instead of {kept}", edges.len());
    ensure!(missed[0] == pulls - kept, "{} edges were missed instead of {}", missed[0], pulls - kept);
    ensure!(missed[1..].iter().all(|m| *m == 0), "missed ones in the middle: {missed:?}");
    ensure!(edges.last().is_some_and(|e| e.level == (pulls % 2 == 1)), "the last edge is not the newest");
    Ok(())
}

pub(crate) fn lost() -> Outcome {
    let chip = Chip::new("lost", 1, &[])?;
    let mut lane = Lane::healthy(&chip, vec![edge("a", 0, &[("buffer", number(16))])])?;
    overflow(&mut lane, &chip, 100, 16)?;
    (0..10).for_each(|n| chip.pull(0, n % 2 == 0));
    let edges = lane.edges(0);
    ensure!(edges.len() == 10, "{} edges of 10 after the loss", edges.len());
    whole(&edges, true)?;
    overflow(&mut lane, &chip, 18, 16)
}

pub(crate) fn lost_largest() -> Outcome {
    let chip = Chip::new("largest", 1, &[])?;
    let mut lane = Lane::healthy(&chip, vec![edge("a", 0, &[])])?;
    overflow(&mut lane, &chip, 1500, 1024)
}

pub(crate) fn storm() -> Outcome {
    let chip = Chip::new("storm", 2, &[])?;
    let mut lane = Lane::healthy(&chip, vec![edge("storm", 0, &[("buffer", number(32))]), edge("calm", 1, &[])])?;
    for n in 0..300 {
        chip.pull(0, n % 2 == 0);
        if n % 100 == 0 {
            chip.pull(1, n % 200 == 0);
        }
    }
    let calm = lane.edges(1);
    ensure!(calm.len() == 3, "{} edges of 3 on the calm line", calm.len());
    whole(&calm, true)?;
    let storm = lane.edges(0);
    ensure!(storm.len() == 32 && storm[0].missed == 268, "storm: {} edges, {} missed", storm.len(), storm[0].missed);
    Ok(())
}

/// The kernel's thread for the edges has priority 50: what is pulled above that, on the one CPU there is, becomes one edge.
pub(crate) fn merged() -> Outcome {
    let chip = Chip::new("merged", 2, &[])?;
    let mut lane = Lane::healthy(&chip, vec![edge("both", 0, &[]), edge("rising", 1, &[("edge", text("rising"))])])?;
    let at_once = |pulls: &[bool]| -> Outcome {
        let hand = || {
            let priority = ThreadPriorityValue::try_from(60)?;
            let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
            set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), policy)
                .map_err(|e| format!("SCHED_FIFO: {e:?}"))?;
            pulls.iter().for_each(|up| chip.pull(0, *up));
            Ok(())
        };
        std::thread::scope(|scope| scope.spawn(hand).join().map_err(|_| "the hand panicked".to_owned())?)
    };
    let taken =
        |lane: &mut Lane, n: usize| -> Vec<(bool, u64)> { lane.edges(n).iter().map(|e| (e.level, e.missed)).collect() };
    chip.pull(0, true);
    ensure!(taken(&mut lane, 0) == [(true, 0)], "the first edge has none before it");
    at_once(&[false, true])?;
    let edges = taken(&mut lane, 0);
    ensure!(edges == [(true, 1)], "down and up at once: {edges:?}");
    at_once(&[false, true, false])?;
    let edges = taken(&mut lane, 0);
    println!("note: down, up and down at once are {edges:?}");
    ensure!(edges.last().is_some_and(|e| !e.0), "the last edge is not the newest: {edges:?}");
    // With one kind of edges equal levels are no sign.
    (0..4).for_each(|n| chip.pull(1, n % 2 == 0));
    let edges = taken(&mut lane, 1);
    ensure!(edges == [(true, 0), (true, 0)], "rising edges alone: {edges:?}");
    Ok(())
}

pub(crate) fn debounce() -> Outcome {
    let chip = Chip::new("bounce", 1, &[])?;
    let mut lane = Lane::healthy(&chip, vec![edge("a", 0, &[("debounce", Span(50_000_000))])])?;
    (0..21).for_each(|n| chip.pull(0, n % 2 == 0));
    std::thread::sleep(Duration::from_millis(300));
    let levels: Vec<bool> = lane.edges(0).iter().map(|e| e.level).collect();
    ensure!(levels == [true], "edges of a bouncing contact: {levels:?}");
    chip.pull(0, false);
    chip.pull(0, true);
    std::thread::sleep(Duration::from_millis(300));
    ensure!(lane.edges(0).is_empty(), "a glitch came through");
    ensure!(lane.level(0) == Some(true), "the debounced level is {:?}", lane.level(0));
    Ok(())
}

pub(crate) fn levels() -> Outcome {
    let chip = Chip::new("levels", 4, &[])?;
    let level = |name: &str, line: usize, bias: &str| {
        (point(name, &[("line", number(line)), ("bias", text(bias))], None), Role::Level)
    };
    chip.pull(1, true);
    chip.pull(2, true);
    let points = vec![
        level("up", 0, "pull-up"),
        level("down", 1, "pull-down"),
        level("as-is", 2, "as-is"),
        edge("edge", 3, &[("bias", text("pull-up"))]),
    ];
    let mut lane = Lane::healthy(&chip, points)?;
    let read = |lane: &mut Lane| (0..4).map(|n| lane.level(n)).collect::<Option<Vec<bool>>>();
    let levels = read(&mut lane);
    ensure!(levels == Some(vec![true, false, true, true]), "levels by bias: {levels:?}");
    for (line, up) in [(0, false), (1, true), (2, false), (3, false)] {
        chip.pull(line, up);
    }
    let levels = read(&mut lane);
    ensure!(levels == Some(vec![false, true, false, false]), "levels by pull: {levels:?}");
    ensure!((0..3).all(|n| lane.direct.descriptor(n).is_none()), "a level point has a descriptor");
    Ok(())
}

pub(crate) fn names() -> Outcome {
    let chip = Chip::new("names", 4, &[(1, "DOOR"), (3, "TRIP")])?;
    let points = vec![
        (point("door", &[("line", text("DOOR"))], None), Role::Edge),
        (point("trip", &[("line", text("TRIP"))], Some(false)), Role::Output),
    ];
    // The chip by its label here, by its path elsewhere, by its name as well.
    let name = chip.path().replace("/dev/", "");
    for key in ["names", &name] {
        let mut lane = Lane::open(key, points.clone())?;
        ensure!(lane.direct.healthy(), "chip \"{key}\": {:?}", lane.told());
        chip.pull(1, true);
        ensure!(lane.edges(0).len() == 1, "no edge by name");
        lane.write(&[true]);
        ensure!(chip.value(3), "no output by name");
        chip.pull(1, false);
    }
    Ok(())
}
