//! Interrupt lanes at virtual time: the rules of the fast-interlock specification, each by its number, and what else an
//! interrupt lane promises.

mod faults;
mod feeds;
mod limits;
mod poll;
mod random;
mod rules;
mod snapshots;

use latchwork_record::{Kind, Record};
use latchwork_tests_plant::{Ran, Rig};

const MS: u64 = 1_000_000;

/// Three fast inputs with one interlock in lane `trip`, three slow ones with one in lane `main`. `lanes` is put into the
/// lane's tables, `rest` follows.
fn plant(main: &str, trip: &str, rest: &str) -> Rig {
    let text = format!(
        r#"
[lane.main]
every = "10ms"
watchdog = "10s"
{main}
[lane.trip]
on = ["gpio.door", "gpio.beam", "gpio.vacuum"]
{trip}
[driver.gpio]
kind = "sim"
points.door = {{ type = "bool" }}
points.beam = {{ type = "bool" }}
points.vacuum = {{ type = "bool" }}
points.level = {{ type = "bool" }}
points.fire = {{ type = "bool" }}
points.dump = {{ type = "bool", from = "fast.outputs.trip" }}
[block.fast]
component = "interlock-probe"
lane = "trip"
inputs = {{ a = "gpio.door", b = "gpio.beam", c = "gpio.vacuum", q = "gpio.door", trap = "gpio.fire" }}
[block.slow]
component = "interlock-probe"
lane = "main"
inputs = {{ a = "gpio.level", b = "gpio.door", c = "fast.outputs.trip", q = "gpio.level" }}
{rest}
"#
    );
    Rig::new(&text)
}

/// The event records of inputs: time, source, level.
fn edges(ran: &Ran) -> Vec<(u64, &str, bool)> {
    let of = |r: &Record| matches!(&*r.transition, "rising" | "falling") && r.kind == Kind::Event;
    ran.records.iter().filter(|r| of(r)).map(|r| (r.time, r.source.as_str(), r.transition == "rising")).collect()
}

/// What was lost, as told: source, transition, number.
fn lost(ran: &Ran) -> Vec<(&str, &str, String)> {
    let of = ran.records.iter().filter(|r| r.kind == Kind::Lost);
    of.map(|r| (r.source.as_str(), &*r.transition, r.current.to_string())).collect()
}

/// Every record has its place by its time.
fn assert_in_order(ran: &Ran) {
    let late = ran.records.windows(2).find(|w| w[1].time < w[0].time || w[1].seq != w[0].seq + 1);
    assert!(late.is_none(), "out of order: {late:?}");
}
