//! What holds for every history, and what slow and obvious computations find.

use latchwork_alarm::report::{CHATTERING, Collector, Event, Report, SECOND, TEN_MINUTES};
use proptest::prelude::*;

const NAMES: [&str; 4] = ["a", "b", "c", "d"];

/// Steps between raises, so that floods begin, go on and end, and alarms chatter now and then.
fn raises() -> impl Strategy<Value = Vec<(u64, usize)>> {
    let step = prop_oneof![
        5 => 0..5 * SECOND,
        3 => (0..4u64).prop_map(|n| n * 15 * SECOND),
        3 => (0..12u64).prop_map(|n| n * 60 * SECOND),
        1 => Just(TEN_MINUTES),
        1 => TEN_MINUTES..5 * TEN_MINUTES,
    ];
    prop::collection::vec((step, 0..NAMES.len()), 0..150).prop_map(|steps| {
        let mut now = 1_800_000_000 * SECOND;
        let at = |(step, name)| {
            now += step;
            (now, name)
        };
        steps.into_iter().map(at).collect()
    })
}

fn report(raises: &[(u64, usize)], from: Option<u64>, to: Option<u64>) -> Report {
    let mut collector = Collector::new(from);
    for (time, name) in raises {
        let priority = 60 * *name as u8;
        collector.take(&Event { time: *time, alarm: NAMES[*name], transition: "raised", state: None, priority });
    }
    collector.finish(to)
}

/// Floods by looking at every moment at which the rate can change: a raise, and ten minutes after it.
fn floods(times: &[u64], to: u64) -> Vec<(u64, u64, u64, bool)> {
    let rate = |at: u64| times.iter().filter(|t| **t <= at && **t + TEN_MINUTES > at).count();
    let mut moments: Vec<u64> = times.iter().flat_map(|t| [*t, *t + TEN_MINUTES]).collect();
    moments.sort_unstable();
    moments.dedup();
    let (mut found, mut began, mut ended) = (Vec::new(), None, 0);
    for at in moments {
        match began {
            None if rate(at) > 10 => {
                // From the first of those that made it, but for those of the last flood.
                began = times.iter().copied().find(|t| *t + TEN_MINUTES > at && *t >= ended);
            }
            Some(start) if rate(at) < 5 => {
                let end = at.min(to);
                let count = times.iter().filter(|t| **t >= start && **t < at).count();
                found.push((start, end, count as u64, at > to));
                (began, ended) = (None, at);
            }
            _ => {}
        }
    }
    assert_eq!(began, None, "the last moment has no alarms any more");
    found
}

/// Chattering raises of one alarm by comparing every three: how many, in how many runs, the fastest.
fn chattering(times: &[u64]) -> (u64, u64, Option<u64>) {
    let mut marked = vec![false; times.len()];
    let mut joined = vec![false; times.len()];
    let mut fastest: Option<u64> = None;
    for i in 0..times.len() {
        for j in i..times.len() {
            if j == i + 2 && times[j] - times[i] <= CHATTERING {
                // Joined with the one before: both are in the same three.
                (joined[i + 1], joined[j]) = (true, true);
                marked[i..=j].fill(true);
                fastest = Some(fastest.map_or(times[j] - times[i], |f| f.min(times[j] - times[i])));
            }
        }
    }
    let runs = (0..times.len()).filter(|i| marked[*i] && !joined[*i]).count() as u64;
    (marked.iter().filter(|m| **m).count() as u64, runs, fastest)
}

proptest! {
    #[test]
    fn floods_are_those_of_the_slow_computation(raises in raises(), more in 0..TEN_MINUTES) {
        let times: Vec<u64> = raises.iter().map(|r| r.0).collect();
        let to = times.last().copied().unwrap_or(0) + more;
        let report = report(&raises, None, Some(to));
        let found: Vec<_> = report.floods.iter().map(|f| (f.start, f.end, f.count, f.open)).collect();
        prop_assert_eq!(found, floods(&times, to));
    }

    #[test]
    fn floods_never_overlap_and_share_no_alarm(raises in raises()) {
        let report = report(&raises, None, None);
        prop_assert!(report.floods.windows(2).all(|w| w[0].end < w[1].start));
        prop_assert!(report.floods.iter().all(|f| f.start <= f.end && f.start >= report.from && f.end <= report.to));
        prop_assert!(report.floods.iter().map(|f| f.count).sum::<u64>() <= report.raised);
        prop_assert!(report.floods.iter().rev().skip(1).all(|f| !f.open));
    }

    #[test]
    fn chattering_is_that_of_the_slow_computation(raises in raises()) {
        let report = report(&raises, None, None);
        for (number, name) in NAMES.into_iter().enumerate() {
            let times: Vec<u64> = raises.iter().filter(|r| r.1 == number).map(|r| r.0).collect();
            let (raised, runs, fastest) = chattering(&times);
            let found = report.chattering.iter().find(|c| &*c.alarm == name);
            prop_assert_eq!(found.map(|c| (c.raised, c.runs, Some(c.fastest))), fastest.map(|_| (raised, runs, fastest)));
        }
    }

    #[test]
    fn sums_agree(raises in raises()) {
        let report = report(&raises, None, None);
        prop_assert_eq!(report.raised, raises.len() as u64);
        prop_assert_eq!(report.bins.iter().map(|b| b.total()).sum::<u64>(), report.raised);
        prop_assert_eq!(report.by_rank().iter().sum::<u64>(), report.raised);
        prop_assert_eq!(report.frequent.iter().map(|f| f.raised).sum::<u64>(), report.raised, "fewer than ten alarms");
        prop_assert!(report.frequent.windows(2).all(|w| w[0].raised >= w[1].raised));
        prop_assert!(report.bins.windows(2).all(|w| w[0].start < w[1].start));
        prop_assert!(report.bins.len() as u64 <= report.periods() || report.raised == 0);
        prop_assert!(report.bins.iter().all(|b| b.total() <= report.peak().map_or(0, |p| p.total())));
        let shares: f64 = report.figures().iter().filter(|f| ["low", "medium", "high", "urgent"].contains(&f.id)).filter_map(|f| f.value).sum();
        prop_assert!(report.raised == 0 || (shares - 100.0).abs() < 1e-9);
        let percents = report.figures().into_iter().filter(|f| f.unit == latchwork_alarm::report::Unit::Percent);
        prop_assert!(percents.filter_map(|f| f.value).all(|v| (0.0..=100.0 + 1e-9).contains(&v)));
    }

    #[test]
    fn two_parts_of_a_time_have_the_alarms_of_the_whole(raises in raises(), cut in 0..10 * TEN_MINUTES) {
        let cut = 1_800_000_000 * SECOND + cut;
        let before: Vec<_> = raises.iter().copied().filter(|r| r.0 < cut).collect();
        let (early, late) = (report(&before, None, Some(cut)), report(&raises, Some(cut), None));
        prop_assert_eq!(early.raised + late.raised, raises.len() as u64);
    }
}

#[test]
fn an_alarm_at_the_very_end_of_a_flood_comes_after_it() {
    let start = 1_800_000_000_000_000_000;
    let mut raises = vec![(start, 0); 11];
    raises.push((start + TEN_MINUTES, 0));
    let report = report(&raises, None, Some(start + TEN_MINUTES));
    let found: Vec<_> = report.floods.iter().map(|f| (f.start, f.end, f.count, f.open)).collect();
    assert_eq!(found, [(start, start + TEN_MINUTES, 11, false)]);
}
