//! Rules 1 to 7 of the specification "Fast interlocks and time-stamped events".

use super::*;

/// Main scans of 8 ms, edges in the middle of them.
const LONG: &str = "scan-time.main = \"8ms\"";

#[test]
fn rule_1_an_edge_refreshes_only_the_inputs_of_its_own_lane() {
    let ran = plant("", "", &format!("[sim]\n{LONG}"))
        .stimulus("3ms,gpio.level,true\n4ms,gpio.door,true\n5ms,gpio.level,false\n22ms,gpio.level,true\n")
        .run_for(60 * MS);
    // The scan from 0 to 8 ms has latched `level` at its start; the edge in it changes nothing of that, and the level is
    // false again when the next scan latches it.
    assert_eq!(ran.history("slow.outputs.a"), [(0, "false"), (30 * MS, "true")]);
    // The lane of the edge saw it at once.
    assert_eq!(ran.history("fast.outputs.a"), [(0, "false"), (4 * MS, "true")]);
}

#[test]
fn rule_2_edges_that_arrive_while_one_is_handled_are_queued_in_time_order() {
    let ran = plant("", "", "[sim]\nscan-time.trip = \"5ms\"")
        .stimulus(
            "1ms,gpio.door,true\n2ms,gpio.beam,true\n3ms,gpio.door,false\n3ms,gpio.beam,false\n4ms,gpio.vacuum,true\n",
        )
        .run_for(100 * MS);
    let all = [(1, "door", true), (2, "beam", true), (3, "door", false), (3, "beam", false), (4, "vacuum", true)];
    let expected: Vec<_> = all.map(|(ms, name, level)| (ms * MS, format!("gpio.{name}"), level)).into();
    let seen: Vec<_> = edges(&ran).into_iter().map(|(t, s, l)| (t, s.to_string(), l)).collect();
    assert_eq!(seen, expected);
    assert_eq!(ran.at("fast.outputs.runs", 100 * MS), "6", "one execution for each, and the first without an edge");
    assert_eq!(lost(&ran), []);
}

#[test]
fn rule_2_an_overflow_of_the_queue_is_counted_and_recorded() {
    let rows: String = (0..60).map(|n| format!("{}us,gpio.beam,{}\n", 1000 + n, n % 2 == 0)).collect();
    let ran =
        plant("", "queue = 16\nwatchdog = \"1s\"", "[sim]\nscan-time.trip = \"5ms\"").stimulus(&rows).run_for(900 * MS);
    assert_in_order(&ran);
    // All but the one that is being handled wait; the newest is kept beyond the 16.
    let handled = edges(&ran).len() as u64;
    let [("gpio.beam", "overflow", count)] = &lost(&ran)[..] else { panic!("{:?}", lost(&ran)) };
    assert_eq!(handled + count.parse::<u64>().unwrap(), 60, "each edge is handled or counted");
    assert!(handled >= 17, "{handled}");
    assert_eq!(edges(&ran).last(), Some(&(1059 * 1000, "gpio.beam", false)), "the end is what the field is");
    assert_eq!(ran.at("fast.outputs.b", 900 * MS), "false");
}

#[test]
fn rule_3_each_change_is_recorded_exactly_once() {
    let rows: String = (0..400).map(|n| format!("{}us,gpio.door,{}\n", 1300 + 700 * n, n % 2 == 0)).collect();
    let ran = plant("", "also-with = \"main\"", &format!("[sim]\n{LONG}")).stimulus(&rows).run_for(400 * MS);
    let expected: Vec<_> = (0..400).map(|n| ((1300 + 700 * n) * 1000, "gpio.door", n % 2 == 0)).collect();
    assert_eq!(edges(&ran), expected);
    // The register of the block changes with every edge, too, and the executions with `main` in between repeat none.
    let register = ran.records.iter().filter(|r| r.source == "fast.outputs.status");
    let times: Vec<_> = register.map(|r| r.time).collect();
    assert_eq!(times, expected.iter().map(|e| e.0).collect::<Vec<_>>());
}

#[test]
fn rule_4_the_time_stamp_is_that_of_the_edge_and_records_leave_in_time_order() {
    let ran = plant("", "", "[sim]\nscan-time.trip = \"9ms\"\nscan-time.main = \"3ms\"")
        .stimulus("1ms,gpio.door,true\n2ms,gpio.beam,true\n3ms,gpio.level,true\n")
        .run_for(100 * MS);
    assert_eq!(edges(&ran), [(MS, "gpio.door", true), (2 * MS, "gpio.beam", true)]);
    assert_in_order(&ran);
    // The second was handled when the first was done, but the block and the record know when it happened.
    assert_eq!(ran.history("fast.outputs.now"), [(0, "0"), (MS, "1000000"), (2 * MS, "2000000")]);
    let of_main = ran.records.iter().find(|r| r.source == "slow.outputs.status").map(|r| r.time);
    assert_eq!(of_main, Some(10 * MS), "a record of the main lane, made before the edges were handled, waits for them");
}

#[test]
fn rule_4_a_block_never_sees_time_go_back() {
    // A storm on the beam holds its last edge, of 101.99 ms, back; the door's of 105 ms is handled first.
    let storm: String = (0..200).map(|n| format!("{}us,gpio.beam,{}\n", 100_000 + 10 * n, n % 2 == 0)).collect();
    let ran = plant("", "storm-limit = 1000", "").stimulus(&format!("{storm}105ms,gpio.door,true\n")).run_for(300 * MS);
    let nows: Vec<u64> = ran.history("fast.outputs.now").into_iter().map(|(_, now)| now.parse().unwrap()).collect();
    assert!(nows.is_sorted(), "{nows:?}");
    assert_eq!(nows.last(), Some(&(105 * MS)), "the held edge came after it, raised to its time");
    // The records keep the true stamps, and their order.
    let last = [(101_990_000, "gpio.beam", false), (105 * MS, "gpio.door", true)];
    assert_eq!(edges(&ran)[edges(&ran).len() - 2..], last);
    assert_eq!(ran.at("fast.outputs.b", 300 * MS), "false");
    assert_in_order(&ran);
}

#[test]
fn rule_5_the_blocks_also_run_once_per_main_cycle_so_commands_reach_them() {
    let ran = plant("", "also-with = \"main\"", "")
        .stimulus("1ms,gpio.door,true\n2ms,gpio.door,false\n35ms,fast.commands.reset,true\n")
        .run_for(100 * MS);
    assert_eq!(ran.at("fast.outputs.runs", 100 * MS), "13", "1 at the start, 10 scans of main, 2 edges");
    // 2 ms: the door is closed again, the trip stays until the command, which comes with the scan at 40 ms.
    assert_eq!(ran.history("fast.outputs.trip"), [(0, "false"), (MS, "true"), (40 * MS, "false")]);
    assert_eq!(ran.at("fast.outputs.resets", 100 * MS), "1");
    assert_eq!(ran.outcome.lanes[1].statistics.scans, 13);
}

#[test]
fn rule_6_an_edge_publishes_no_other_output_early() {
    // `main` computes its output from 10 ms on, but shows it at the end of its scan at 18 ms; the edge at 14 ms writes the
    // lane's own outputs and nothing of it.
    let rest = format!(
        "[block.watch]\ncomponent = \"interlock-probe\"\nlane = \"trip\"\ninputs.b = \"slow.outputs.a\"\n[sim]\n{LONG}"
    );
    let ran = plant("", "", &rest)
        .stimulus("9ms,gpio.level,true\n14ms,gpio.door,true\n19ms,gpio.beam,true\n")
        .run_for(60 * MS);
    assert_eq!(ran.history("watch.outputs.b"), [(0, "false"), (19 * MS, "true")]);
    assert_eq!(ran.history("gpio.dump"), [(0, "false"), (14 * MS, "true")]);
}

#[test]
fn rule_6_two_readers_in_one_cycle_see_the_same() {
    let rest = "[block.again]\ncomponent = \"interlock-probe\"\nlane = \"main\"\n\
                inputs = { b = \"gpio.door\", c = \"fast.outputs.trip\" }\n[sim]\nscan-time.main = \"10ms\"";
    let rows: String = (0..50).map(|n| format!("{}us,gpio.door,{}\n", 10_000 + 333 * n, n % 2 == 0)).collect();
    let ran = plant("", "", rest).stimulus(&rows).run_for(100 * MS);
    assert_eq!(ran.history("slow.outputs.b"), ran.history("again.outputs.b"));
    assert_eq!(ran.history("slow.outputs.c"), ran.history("again.outputs.c"));
    assert!(ran.history("slow.outputs.c").len() > 1);
}

#[test]
fn rule_7_the_response_does_not_depend_on_the_length_of_the_main_cycle() {
    let run = |scan: &str| {
        let rows = "1ms,gpio.door,true\n2500us,gpio.door,false\n777ms,gpio.beam,true\n999ms,gpio.vacuum,true\n";
        let ran = plant("", "", &format!("[sim]\nscan-time.main = \"{scan}\"")).stimulus(rows).run_for(3000 * MS);
        let of_trip: Vec<_> = ran.trace.iter().filter(|(_, tag, _)| tag.starts_with("fast.outputs")).cloned().collect();
        (of_trip, edges(&ran).into_iter().map(|(t, s, l)| (t, s.to_string(), l)).collect::<Vec<_>>())
    };
    let shortest = run("1ms");
    assert_eq!(shortest.1.len(), 4);
    for scan in ["10ms", "100ms", "1000ms"] {
        assert_eq!(run(scan), shortest, "main scans of {scan}");
    }
}
