//! Every edge once, in order, with its own time.

use crate::Done;
use crate::chip::Chip;
use crate::field::{BEAM, DOOR, VACUUM, running, started};
use crate::run::{Run, records, text, told, until};
use rustix::process::Signal;
use rustix::time::{ClockId, clock_gettime};
use std::collections::BTreeMap;
use std::time::Duration;

/// Edges that are made at random on the three fast lines, and most of one burst.
const EDGES: usize = 10_000;
const BURST: usize = 5;
const FAST: [(usize, &str); 3] = [(DOOR, "gpio.door"), (BEAM, "gpio.beam"), (VACUUM, "gpio.vacuum")];

/// An edge as it was made: the value after it, and CLOCK_MONOTONIC before and after the hand that made it, ns.
struct Made {
    value: bool,
    from: i128,
    to: i128,
}

/// An edge as it is recorded: time (ns since 1970) and the value after it.
struct Seen {
    at: i128,
    value: bool,
}

fn now(clock: ClockId) -> i128 {
    let now = clock_gettime(clock);
    i128::from(now.tv_sec) * 1_000_000_000 + i128::from(now.tv_nsec)
}

/// Numbers without a pattern, the same every time.
fn random(state: &mut u64) -> usize {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as usize
}

/// Moves a line in bursts with pauses.
fn pull(chip: &Chip, line: usize, count: usize) -> Vec<Made> {
    let (mut made, mut state, mut value) = (Vec::new(), line as u64, true);
    while made.len() < count {
        for _ in 0..(1 + random(&mut state) % BURST).min(count - made.len()) {
            value = !value;
            let from = now(ClockId::Monotonic);
            chip.pull(line, !value);
            made.push(Made { value, from, to: now(ClockId::Monotonic) });
        }
        std::thread::sleep(Duration::from_micros(random(&mut state) as u64 % 300));
    }
    made
}

/// Edges on record, in the order of the records, by line.
fn seen() -> Result<Vec<(&'static str, Seen)>, String> {
    let mut seen = Vec::new();
    for record in records().iter().filter(|r| r["kind"] == "event") {
        let Some((_, name)) = FAST.iter().find(|f| record["source"] == f.1) else { continue };
        let time = record["time"].as_str().and_then(|t| t.parse::<jiff::Timestamp>().ok());
        let at = time.ok_or_else(|| format!("no time: {record}"))?.as_nanosecond();
        seen.push((*name, Seen { at, value: record["transition"] == "rising" }));
    }
    Ok(seen)
}

pub(crate) fn ten_thousand(chip: &mut Chip) -> Done {
    let chip = &*chip;
    let run = running(chip)?;
    // By their text: this machine takes its time to read ten thousand lines of JSON.
    let is_edge = |l: &&str| l.contains(r#""kind":"event""#) && FAST.iter().any(|f| l.contains(f.1));
    let count = || text().lines().filter(is_edge).count();
    let settled = || {
        let before = count();
        std::thread::sleep(Duration::from_millis(600));
        before == count()
    };
    until("the first edges are recorded", settled)?;
    let first = count();
    // Three hands at the same time.
    let made: BTreeMap<&str, Vec<Made>> = std::thread::scope(|scope| {
        let hands = FAST.map(|(line, name)| (name, scope.spawn(move || pull(chip, line, EDGES / FAST.len()))));
        hands.into_iter().map(|(name, hand)| (name, hand.join().unwrap_or_default())).collect()
    });
    let all = made.values().map(Vec::len).sum::<usize>();
    until("every edge is recorded", || {
        std::thread::sleep(Duration::from_millis(200));
        count() >= first + all
    })?;
    until("no more come", settled)?;
    let seen = seen()?.split_off(first);
    if let Some(lost) = records().into_iter().find(|r| r["kind"] == "lost") {
        return Err(format!("edges were lost: {lost}"));
    }
    if let Some(w) = seen.windows(2).find(|w| w[1].1.at < w[0].1.at) {
        return Err(format!("the records are not in the order of their times: {} then {}", w[0].1.at, w[1].1.at));
    }
    judge(&made, &seen)?;
    let status = run.end(Signal::TERM)?;
    if status.success() { Ok(()) } else { Err(format!("latchwork ended with {status}")) }
}

/// Compares what was made with what is recorded.
fn judge(made: &BTreeMap<&str, Vec<Made>>, seen: &[(&str, Seen)]) -> Done {
    // Records carry the time of day. Some one difference to the clock of the hands must put every stamp between the two moments
    // at which its hand looked at the clock.
    let (mut low, mut high) = (i128::MIN, i128::MAX);
    for (name, made) in made {
        let seen: Vec<&Seen> = seen.iter().filter(|s| s.0 == *name).map(|s| &s.1).collect();
        let same = made.len() == seen.len() && made.iter().zip(&seen).all(|(m, s)| m.value == s.value);
        if !same {
            return Err(format!("{name}: {} edges made, {} recorded, or not in this order", made.len(), seen.len()));
        }
        if let Some(w) = seen.windows(2).find(|w| w[1].at <= w[0].at) {
            return Err(format!("{name}: the stamps do not rise: {} then {}", w[0].at, w[1].at));
        }
        for (made, seen) in made.iter().zip(seen) {
            (low, high) = (low.max(seen.at - made.to), high.min(seen.at - made.from));
        }
    }
    if low > high {
        return Err(format!("stamps are not those of the edges: off by {} ns at least", (low - high) / 2));
    }
    let off = (low + high) / 2 - (now(ClockId::Realtime) - now(ClockId::Monotonic));
    if off.abs() > 500_000_000 {
        return Err(format!("records are {off} ns away from the time of day"));
    }
    Ok(())
}

pub(crate) fn held(chip: &mut Chip) -> Done {
    let line = gpiocdev::Request::builder()
        .on_chip(&chip.device)
        .with_consumer("squatter")
        .with_line(BEAM as u32)
        .as_input()
        .request()
        .map_err(|e| format!("the line could not be taken: {e}"))?;
    let run = Run::start(&chip.path(), None)?;
    until("the refusal names the holder", || {
        told("gpio.beam", "refused").iter().any(|r| r["text"].as_str().is_some_and(|t| t.contains("squatter")))
    })?;
    // The others work meanwhile.
    started(chip)?;
    chip.pull(DOOR, true);
    until("an edge of another line", || !told("gpio.door", "falling").is_empty())?;
    if !told("gpio.beam", "rising").is_empty() || !told("gpio.beam", "falling").is_empty() {
        return Err("edges of a line that another holds".into());
    }
    drop(line);
    until("the line is taken over", || told("gpio.beam", "accepted").len() == 1)?;
    let edges = || (told("gpio.beam", "rising").len(), told("gpio.beam", "falling").len());
    chip.pull(BEAM, false);
    until("its first edge is recorded", || edges().0 > 0)?;
    let (rising, falling) = edges();
    for _ in 0..10 {
        chip.pull(BEAM, true);
        chip.pull(BEAM, false);
    }
    until("its edges are recorded", || edges() == (rising + 10, falling + 10))?;
    std::thread::sleep(Duration::from_millis(600));
    if edges() != (rising + 10, falling + 10) || (rising, falling) != (1, 0) {
        return Err(format!("at first {rising} rising and {falling} falling, after ten each {:?}", edges()));
    }
    run.end(Signal::TERM).map(drop)
}
