//! Machines that a user may meet, whole reports as goldens, and each check's cases as a table.

mod cases;
mod devices;
mod machines;

use super::needs::{LaneKind, LaneNeeds, LineName, LineNeeds, Needs};
use super::{Finding, Status, examine, json, text};
use insta::assert_snapshot;
use machines::{Fake, container, pi_4, pi_5, virtual_machine};

fn lane(name: &str, kind: LaneKind, priority: u8, cpu: Option<usize>) -> LaneNeeds {
    LaneNeeds { name: name.into(), priority, cpu, kind }
}

fn wanted(point: &str, chip: Option<&str>, number: u32) -> LineNeeds {
    LineNeeds { point: point.into(), chip: chip.map(String::from), line: LineName::Number(number) }
}

/// A plant with everything: edges, a serial line, a watchdog.
fn interlock(main: u8, trip: u8, cpu: Option<usize>) -> Needs {
    Needs {
        lanes: vec![lane("main", LaneKind::Cyclic, main, None), lane("trip", LaneKind::Edges, trip, cpu)],
        gpio: vec![("pins".into(), Some("/dev/gpiochip0".into()))],
        rppal: Vec::new(),
        lines: vec![wanted("pins.door", Some("/dev/gpiochip0"), 17)],
        serial: vec!["/dev/ttyUSB0".into()],
        watchdog: Some("/dev/watchdog".into()),
    }
}

fn report(fake: &Fake, needs: Option<&Needs>) -> String {
    text("The machine", &examine(&fake.machine, needs), false)
}

fn findings(fake: &Fake, needs: Option<&Needs>) -> Vec<Finding> {
    examine(&fake.machine, needs).into_iter().flat_map(|(_, findings)| findings).collect()
}

#[test]
fn an_untuned_pi_4() {
    assert_snapshot!(report(&pi_4(), None));
}

#[test]
fn an_untuned_pi_4_for_a_plant() {
    assert_snapshot!(report(&pi_4(), Some(&interlock(50, 80, Some(4)))));
}

#[test]
fn a_tuned_pi_5_for_a_plant() {
    let (fake, needs) = (pi_5(), interlock(40, 45, Some(3)));
    assert_snapshot!(report(&fake, Some(&needs)));
    let all_well = findings(&fake, Some(&needs)).iter().all(|f| f.status == Status::Ok && f.mend.is_empty());
    assert!(all_well, "docs/tuning-raspberry-pi.md promises that nothing is left to note");
}

#[test]
fn a_virtual_machine() {
    assert_snapshot!(report(&virtual_machine(), None));
}

#[test]
fn a_container_without_capabilities() {
    assert_snapshot!(report(&container(), None));
}

#[test]
fn a_machine_that_tells_nothing() {
    assert_snapshot!(report(&Fake::new().without("/etc").without("/proc").refused(), None));
}

#[test]
fn a_report_as_json() {
    let groups = examine(&pi_4().machine, Some(&interlock(50, 80, Some(4))));
    assert_snapshot!(json(&groups).unwrap());
}

#[test]
fn colours_change_nothing_else() {
    let groups = examine(&pi_4().machine, None);
    let coloured = text("The machine", &groups, true);
    assert!(coloured.contains("\x1b[1;31mbad \x1b[0m"), "{coloured}");
    let plain =
        ["\x1b[0m", "\x1b[1m", "\x1b[32m", "\x1b[33m", "\x1b[1;31m"].iter().fold(coloured, |t, c| t.replace(c, ""));
    assert_eq!(plain, text("The machine", &groups, false));
}

#[test]
fn whatever_is_wanting_says_how_it_is_mended() {
    let plant = interlock(50, 80, Some(4));
    let machines = [pi_4(), pi_5(), virtual_machine(), container(), Fake::new()];
    for (n, fake) in machines.iter().enumerate() {
        for finding in [None, Some(&plant)].into_iter().flat_map(|needs| findings(fake, needs)) {
            let mended = finding.status == Status::Ok || !finding.mend.is_empty() || finding.check == "virtual-machine";
            assert!(mended, "machine {n}: {finding:?}");
        }
    }
}
