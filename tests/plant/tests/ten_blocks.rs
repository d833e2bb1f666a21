//! A plant of ten blocks, one of them of a class that only this test's guest knows, for a minute of virtual time.

use latchwork_tests_plant::{Ran, Rig};

const MS: u64 = 1_000_000;
const S: u64 = 1_000 * MS;

/// Two lanes; blocks that read each other within a lane, across lanes, forwards and backwards.
const PLANT: &str = r#"
[lane.main]
every = "10ms"
priority = 50
[lane.slow]
every = "100ms"
priority = 40

[driver.field]
kind = "sim"
[driver.field.points]
level = { type = "u16" }
door = { type = "bool" }
lamp = { type = "bool", from = "unit.outputs.lamp" }

[block.clock]
component = "multivibrator"
lane = "main"
inputs.run = true
settings.on-time = "500ms"
settings.off-time = "500ms"

[block.edge]
component = "r-trig"
lane = "main"
inputs.clk = "clock.outputs.out"

[block.seconds]
component = "ctu"
lane = "main"
inputs.cu = "clock.outputs.out"
inputs.pv = 30

[block.half]
component = "sr"
lane = "main"
inputs.s1 = "seconds.outputs.q"

[block.unit]
component = "alarm-unit"
lane = "main"
inputs.level = "field.level"
inputs.door = "field.door"

[block.zone-b.motor]
component = "small-user-class"
lane = "main"
@USER@

[block.delay]
component = "ton"
lane = "main"
inputs.in = "half.outputs.q1"
inputs.pt = "5s"

[block.falls]
component = "f-trig"
lane = "slow"
inputs.clk = "unit.outputs.violation"

[block.acknowledged]
component = "ctu"
lane = "slow"
inputs.cu = "falls.outputs.q"
inputs.pv = 100

[block.latch]
component = "rs"
lane = "slow"
inputs.s = "delay.outputs.q"
inputs.r1 = { tag = "half.outputs.q1", not = true }
"#;

const STIMULUS: &str = "0s,field.level,16384\n5s,field.door,true\n8s,unit.commands.acknowledge,true\n\
    9s,field.door,false\n20s,field.door,true\n25s,unit.commands.acknowledge,true\n";

fn run() -> Ran {
    let user = "inputs.request = \"half.outputs.q1\"\ninputs.speed = 2.5";
    Rig::new(&PLANT.replace("@USER@", user)).stimulus(STIMULUS).run_for(60 * S)
}

#[test]
fn ten_blocks_with_a_users_own_class_for_a_minute() {
    let ran = run();
    let scans: Vec<_> = ran.outcome.lanes.iter().map(|l| (l.name.as_str(), l.statistics.scans)).collect();
    assert_eq!(scans, [("main", 6_000), ("slow", 600)]);
    assert!(ran.outcome.faulted.is_empty());
    // A clock of one second: 60 rising edges, one execution each.
    assert_eq!(ran.history("edge.outputs.q").iter().filter(|(_, v)| *v == "true").count(), 60);
    assert_eq!(ran.at("seconds.outputs.cv", 60 * S), "60");
    // The 30th second begins after 29 s; five seconds later the delay has passed.
    assert_eq!(ran.history("half.outputs.q1"), [(0, "false"), (29 * S, "true")]);
    assert_eq!(ran.history("delay.outputs.q"), [(0, "false"), (34 * S, "true")]);
    // The slow lane sees it in its scan of that very time: the lane of higher priority goes first.
    assert_eq!(ran.history("latch.outputs.q1"), [(0, "false"), (34 * S, "true")]);
    // Two acknowledgements, and the one pulse that the standard's F_TRIG makes in its first execution.
    assert_eq!(ran.at("acknowledged.outputs.cv", 60 * S), "3");
    assert_eq!(ran.at("zone-b.motor.outputs.running", 29 * S), "true");
}

#[test]
fn a_second_run_is_the_same() {
    let (one, two) = (run(), run());
    assert_eq!(one.trace, two.trace);
    assert_eq!(one.records, two.records);
    assert!(one.trace.len() > 500 && !one.records.is_empty());
}
