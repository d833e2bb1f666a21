//! Storms: a line that makes too many edges is followed slowly, counted, and starves nobody.

use super::*;

/// `n` edges on a line, one every `step` µs from `from` µs on.
fn burst(line: &str, from: u64, step: u64, n: u64) -> String {
    (0..n).map(|i| format!("{}us,{line},{}\n", from + i * step, i % 2 == 0)).collect()
}

#[test]
fn a_storm_is_recorded_when_it_begins_and_with_its_number_when_it_ends() {
    // 1000 a second are allowed, 10 000 a second come for half a second.
    let ran = plant("", "storm-limit = 1000", "").stimulus(&burst("gpio.beam", 100_000, 100, 5000)).run_for(2000 * MS);
    let told = lost(&ran);
    assert_eq!(told.iter().map(|t| t.1).collect::<Vec<_>>(), ["storm", "storm-end"]);
    let left_out: usize = told[1].2.parse().unwrap();
    let handled = edges(&ran);
    assert_eq!(handled.len() + left_out, 5000, "every edge is handled or counted");
    // A tenth of a second's worth at once, what the limit gives meanwhile, then 100 a second.
    assert!((100..=180).contains(&handled.len()), "{}", handled.len());
    assert_eq!(*handled.last().unwrap(), ((100_000 + 4999 * 100) * 1000, "gpio.beam", false), "the last one counts");
    assert_in_order(&ran);
}

#[test]
fn a_storm_on_one_line_delays_no_other() {
    let storm = burst("gpio.beam", 1000, 10, 50_000);
    let rows = format!("{storm}20ms,gpio.door,true\n300ms,gpio.door,false\n400ms,gpio.vacuum,true\n");
    let ran = plant("", "storm-limit = 1000\nwatchdog = \"1s\"", "[sim]\nscan-time.trip = \"50us\"")
        .stimulus(&rows)
        .run_for(1000 * MS);
    let others: Vec<_> = edges(&ran).into_iter().filter(|e| e.1 != "gpio.beam").collect();
    let expected = [(20 * MS, "gpio.door", true), (300 * MS, "gpio.door", false), (400 * MS, "gpio.vacuum", true)];
    assert_eq!(others, expected);
    // The cyclic lane has all its scans.
    assert_eq!(ran.outcome.lanes[0].statistics.scans, 100);
}

#[test]
fn a_bouncing_contact_is_no_storm() {
    let ran = plant("", "storm-limit = 1000", "").stimulus(&burst("gpio.door", 1000, 20, 99)).run_for(500 * MS);
    assert_eq!((edges(&ran).len(), lost(&ran)), (99, vec![]));
}

#[test]
fn a_line_at_the_edge_of_its_limit_does_not_flutter() {
    // 950 a second with 1000 allowed, after a storm: it must fall to half before it counts as calm, and then it stays so.
    let rows = burst("gpio.beam", 1000, 100, 3000) + &burst("gpio.beam", 302_000, 1053, 3000);
    let ran = plant("", "storm-limit = 1000", "").stimulus(&rows).run_for(5000 * MS);
    assert_eq!(lost(&ran).iter().map(|t| t.1).collect::<Vec<_>>(), ["storm", "storm-end"]);
}

#[test]
fn what_was_never_handled_is_told_at_the_end() {
    let ran = plant("", "watchdog = \"9s\"", "[sim]\nscan-time.trip = \"400ms\"")
        .stimulus(&burst("gpio.beam", 1000, 1000, 5))
        .run_for(600 * MS);
    let told = lost(&ran);
    let [("gpio.beam", "left-out", count)] = &told[..] else { panic!("{told:?}") };
    assert_eq!(edges(&ran).len() + count.parse::<usize>().unwrap(), 5);
}
