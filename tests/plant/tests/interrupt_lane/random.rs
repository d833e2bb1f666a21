//! Thousands of edges at random times against random scan lengths, compared with a plain model of what must happen.

use super::*;
use proptest::prelude::*;

const LINES: [&str; 3] = ["gpio.door", "gpio.beam", "gpio.vacuum"];
const END: u64 = 1000 * MS;

/// Edges by time: line and level after each.
fn timeline(mut at: Vec<(u64, usize)>) -> Vec<(u64, usize, bool)> {
    at.sort_by_key(|(time, _)| *time);
    let mut levels = [false; 3];
    let edge = |(time, line): (u64, usize)| {
        levels[line] = !levels[line];
        (time, line, levels[line])
    };
    at.into_iter().map(edge).collect()
}

/// The history of one output, as the trace shows it: a row where it changed.
fn history(values: impl Iterator<Item = (u64, bool)>) -> Vec<(u64, &'static str)> {
    let mut last = None;
    values
        .filter(|(_, value)| last.replace(*value) != Some(*value))
        .map(|(time, value)| (time, if value { "true" } else { "false" }))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn every_edge_has_one_record_with_its_stamp_and_the_outputs_follow_the_model(
        at in prop::collection::vec((MS..END - 100 * MS, 0..3usize), 2000..4000),
        main in prop::collection::vec(0..40_000u64, 1..8),
        trip in prop::collection::vec(0..120u64, 1..8),
        also in any::<bool>(),
    ) {
        let edges_made = timeline(at);
        let times = |list: &[u64]| list.iter().map(|us| format!("\"{us}us\"")).collect::<Vec<_>>().join(", ");
        let also = if also { "also-with = \"main\"" } else { "" };
        let sim = format!("[sim]\nscan-time.main = [{}]\nscan-time.trip = [{}]", times(&main), times(&trip));
        let rows: String =
            edges_made.iter().map(|(time, line, level)| format!("{time}ns,{},{level}\n", LINES[*line])).collect();
        let ran = plant("", &format!("queue = 8192\nstorm-limit = 1000000\nwatchdog = \"1s\"\n{also}"), &sim)
            .stimulus(&rows)
            .trace(Some("fast.outputs.{a,b,c,trip}"))
            .run_for(END);

        let expected: Vec<_> = edges_made.iter().map(|(time, line, level)| (*time, LINES[*line], *level)).collect();
        prop_assert_eq!(edges(&ran), expected);
        prop_assert_eq!(lost(&ran), vec![]);
        let late = ran.records.windows(2).find(|w| w[1].time < w[0].time);
        prop_assert!(late.is_none(), "out of order: {late:?}");

        for (line, output) in ["a", "b", "c"].iter().enumerate() {
            let of = edges_made.iter().filter(|e| e.1 == line).map(|e| (e.0, e.2));
            let model = history(std::iter::once((0, false)).chain(of));
            let tag = format!("fast.outputs.{output}");
            prop_assert_eq!(ran.history(&tag), model);
        }
        let first = edges_made.iter().find(|e| e.1 == 0).map(|e| (e.0, true));
        prop_assert_eq!(ran.history("fast.outputs.trip"), history(std::iter::once((0, false)).chain(first)));
    }

    #[test]
    fn beyond_the_limits_every_edge_is_handled_or_counted_and_the_end_is_right(
        at in prop::collection::vec((MS..END - 300 * MS, 0..3usize), 200..1500),
        burst in (MS..END - 400 * MS, 0..3usize, 50..2000u64, 200..40_000u64),
        trip in prop::collection::vec(0..6000u64, 1..8),
        also in any::<bool>(),
    ) {
        let (from, line, n, step) = burst;
        let edges_made = timeline(at.into_iter().chain((0..n).map(|i| (from + i * step, line))).collect());
        let times: Vec<_> = trip.iter().map(|us| format!("\"{us}us\"")).collect();
        let also = if also { "also-with = \"main\"" } else { "" };
        let sim = format!("[sim]\nscan-time.trip = [{}]", times.join(", "));
        let rows: String =
            edges_made.iter().map(|(time, line, level)| format!("{time}ns,{},{level}\n", LINES[*line])).collect();
        let ran = plant("", &format!("queue = 32\nstorm-limit = 1000\nwatchdog = \"1s\"\n{also}"), &sim)
            .stimulus(&rows)
            .trace(Some("fast.outputs.{a,b,c,now}"))
            .run_for(4 * END);

        let late = ran.records.windows(2).find(|w| w[1].time < w[0].time);
        prop_assert!(late.is_none(), "out of order: {late:?}");
        let handled = edges(&ran);
        for (line, name) in LINES.iter().enumerate() {
            let made: Vec<_> = edges_made.iter().filter(|e| e.1 == line).map(|e| (e.0, *name, e.2)).collect();
            let seen: Vec<_> = handled.iter().filter(|e| e.1 == *name).copied().collect();
            let counted = lost(&ran).iter().filter(|l| l.0 == *name).map(|l| l.2.parse::<u64>().unwrap_or(0)).sum::<u64>();
            prop_assert_eq!(seen.len() as u64 + counted, made.len() as u64, "{}", name);
            // What is handled did happen, each once, and the last one always is.
            prop_assert!(seen.iter().all(|e| made.contains(e)) && seen.windows(2).all(|w| w[0].0 <= w[1].0), "{}", name);
            prop_assert_eq!(seen.last(), made.last());
            let end = made.last().is_some_and(|e| e.2);
            let output = format!("fast.outputs.{}", ["a", "b", "c"][line]);
            prop_assert_eq!(ran.at(&output, 4 * END), if end { "true" } else { "false" });
        }
        let nows: Vec<u64> = ran.history("fast.outputs.now").into_iter().filter_map(|(_, n)| n.parse().ok()).collect();
        prop_assert!(nows.is_sorted());
    }
}
