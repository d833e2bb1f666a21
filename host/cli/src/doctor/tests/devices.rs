//! Cases of the checks of devices, folders and lanes.

use super::cases::{cyclic, table};
use super::machines::{DIALOUT, Fake, GPIO, container, pi_4, pi_5, virtual_machine};
use super::{findings, interlock, lane, wanted};
use crate::doctor::Status;
use crate::doctor::machine::Cache;
use crate::doctor::needs::{LaneKind, LineName, LineNeeds, Needs};

#[test]
fn gpio() {
    let wants = |chip: &str| Some(Needs { gpio: vec![("pins".into(), Some(chip.into()))], ..Needs::default() });
    let member = |fake: Fake| fake.file("/etc/group", "gpio:x:993:bob,alice");
    let link_to_closed = || pi_4().link("/dev/pins", "/dev/gpiochip1");
    let rule = || Fake::new().node("/dev/gpiochip0", "r", 0, 0o644);
    table(
        "gpio-chips",
        [
            ("allowed", pi_5(), wants("/dev/gpiochip0"), Status::Ok, "/dev/gpiochip0 may be read and written"),
            ("by a label", pi_5(), wants("pinctrl-rp1"), Status::Ok, "may be read and written"),
            ("refused and needed", pi_4(), wants("gpiochip0"), Status::Bad, "usermod -aG gpio alice"),
            (
                "refused, another is needed",
                Fake::new().node("/dev/gpiochip0", "rw", GPIO, 0o660).node("/dev/gpiochip1", "", GPIO, 0o660),
                wants("gpiochip0"),
                Status::Note,
                "/dev/gpiochip1 may be neither",
            ),
            ("refused and not needed", pi_4(), cyclic(), Status::Note, "usermod -aG gpio alice"),
            ("member since a moment ago", member(pi_4()), wants("gpiochip0"), Status::Bad, "newgrp gpio"),
            (
                "no group may",
                rule(),
                wants("gpiochip0"),
                Status::Bad,
                r#"KERNEL=="gpiochip*", GROUP="gpio", MODE="0660""#,
            ),
            ("another chip", pi_5(), wants("/dev/gpiochip4"), Status::Bad, "latchwork gpio"),
            (
                "a link to it",
                pi_5().link("/dev/gpiochip4", "/dev/gpiochip0"),
                wants("gpiochip4"),
                Status::Ok,
                "may be read",
            ),
            ("a link to a closed one", link_to_closed(), wants("/dev/pins"), Status::Bad, "usermod -aG gpio alice"),
            (
                "another label",
                pi_5(),
                wants("pinctrl-bcm2711"),
                Status::Bad,
                "pinctrl-bcm2711, which driver pins names, is not there; here is /dev/gpiochip0 (\"pinctrl-rp1\")",
            ),
            (
                "a label of a closed chip, perhaps",
                pi_4(),
                wants("pinctrl-bcm2711"),
                Status::Bad,
                "usermod -aG gpio alice",
            ),
            (
                "a label of two chips",
                pi_5().chip("/dev/gpiochip7", "pinctrl-rp1", &[]),
                wants("pinctrl-rp1"),
                Status::Bad,
                "/dev/gpiochip0 and /dev/gpiochip7 have the label",
            ),
            ("no chip, needed", virtual_machine(), wants("pinctrl"), Status::Bad, "no /dev/gpiochip*"),
            ("no chip, not needed", virtual_machine(), None, Status::Ok, "none needed"),
        ],
    );
    let rppal = || Some(Needs { rppal: vec!["board".into()], ..Needs::default() });
    table(
        "gpio-registers",
        [
            ("Pi 5", pi_5(), rppal(), Status::Ok, "/dev/gpiomem0"),
            ("Pi 4, refused", pi_4(), rppal(), Status::Bad, "/dev/gpiomem may be neither"),
            ("Pi 4, not needed", pi_4(), None, Status::Note, "/dev/gpiomem may be neither"),
            ("no Raspberry Pi", virtual_machine(), rppal(), Status::Bad, "kind = \"gpio\"  # in [driver.board]"),
        ],
    );
    assert!(findings(&virtual_machine(), None).iter().all(|f| f.check != "gpio-registers"));
}

#[test]
fn gpio_lines() {
    let wants = |lines: Vec<LineNeeds>| Some(Needs { lines, ..Needs::default() });
    let one = |chip: &str, number| wants(vec![wanted("pins.door", Some(chip), number)]);
    let board = || {
        let holders = [None, Some("spi0 CS0"), Some(""), Some("latchwork gpio.door")];
        Fake::new().chip("/dev/gpiochip0", "pinctrl-rp1", &holders).link("/dev/gpiochip4", "/dev/gpiochip0")
    };
    table(
        "gpio-lines",
        [
            ("free", board(), one("gpiochip0", 0), Status::Ok, "the line"),
            (
                "held",
                board(),
                one("pinctrl-rp1", 1),
                Status::Bad,
                "line 1 of /dev/gpiochip0 (pins.door) by \"spi0 CS0\"",
            ),
            ("held, by a link", board(), one("/dev/gpiochip4", 2), Status::Bad, "somebody who gave no name"),
            ("held by a plant", board(), one("gpiochip0", 3), Status::Note, "latchwork gpio.door"),
            ("not there", board(), one("gpiochip0", 4), Status::Bad, "not there: line 4"),
            ("of a Raspberry Pi's pins", board(), wants(vec![wanted("pi.door", None, 1)]), Status::Bad, "spi0 CS0"),
            (
                "by its name",
                board(),
                wants(vec![LineNeeds {
                    line: LineName::Name("GPIO1".into()),
                    ..wanted("pins.door", Some("gpiochip0"), 0)
                }]),
                Status::Bad,
                "line \"GPIO1\" of /dev/gpiochip0 (pins.door) by \"spi0 CS0\"",
            ),
        ],
    );
    // A chip that cannot be read is a finding of another check.
    assert!(findings(&pi_4(), one("gpiochip0", 1).as_ref()).iter().all(|f| f.check != "gpio-lines"));
}

#[test]
fn watchdog() {
    let wants = || Some(Needs { watchdog: Some("/dev/watchdog".into()), ..Needs::default() });
    let held = || pi_5().file("/sys/class/watchdog/watchdog0/state", "active");
    table(
        "watchdog",
        [
            ("free", pi_5(), wants(), Status::Ok, "(Broadcom BCM2835 Watchdog timer) is there and free"),
            ("systemd has it", held(), wants(), Status::Bad, "RuntimeWatchdogSec=0"),
            ("systemd has it, not needed", held(), cyclic(), Status::Ok, "in use"),
            ("refused", pi_4(), wants(), Status::Bad, r#"KERNEL=="watchdog*", GROUP="watchdog""#),
            ("refused, not needed", pi_4(), cyclic(), Status::Note, "may not be written"),
            ("for ever", pi_5().file("/sys/class/watchdog/watchdog0/nowayout", "1"), wants(), Status::Note, "nowayout"),
            (
                "none on a Pi",
                Fake::new().file("/proc/device-tree/model", "Raspberry Pi 3"),
                wants(),
                Status::Bad,
                "dtparam=watchdog=on",
            ),
            ("none on a PC", virtual_machine(), wants(), Status::Bad, "modprobe"),
        ],
    );
}

#[test]
fn serial_ports_only_for_a_plant() {
    let wants = || Some(Needs { serial: vec!["/dev/ttyUSB0".into()], ..Needs::default() });
    table(
        "serial-ports",
        [
            ("allowed", pi_5(), wants(), Status::Ok, "may be read and written"),
            (
                "refused",
                pi_4().node("/dev/ttyUSB0", "", DIALOUT, 0o660),
                wants(),
                Status::Bad,
                "usermod -aG dialout alice",
            ),
            ("not there", pi_4(), wants(), Status::Bad, "/dev/serial/by-id/"),
        ],
    );
    assert!(findings(&pi_5(), None).iter().all(|f| f.check != "serial-ports"));
}

#[test]
fn cache_folder() {
    let in_folder = |fake: Fake, rights: &str, mode| fake.node("/home/alice/.cache/latchwork", rights, 1000, mode);
    let elsewhere = |mut fake: Fake| {
        fake.machine.cache = Cache::Folder("/var/cache/latchwork".into());
        fake
    };
    table(
        "cache-folder",
        [
            ("there", pi_5(), None, Status::Ok, "/home/alice/.cache/latchwork"),
            ("will be made", pi_4(), None, Status::Ok, "will be made"),
            ("others may write", virtual_machine(), None, Status::Note, "chmod go-w"),
            ("read-only", in_folder(pi_4(), "r", 0o500), None, Status::Note, "chmod u+w"),
            (
                "another user's",
                elsewhere(pi_4()).node("/var/cache/latchwork", "r", 0, 0o755),
                None,
                Status::Note,
                "sudo chown alice",
            ),
            (
                "cannot be made",
                elsewhere(pi_4()).node("/var/cache", "r", 0, 0o755),
                None,
                Status::Note,
                "sudo install -d -o alice -m 700",
            ),
            ("no home", container(), None, Status::Note, "LATCHWORK_CACHE"),
        ],
    );
    let mut unwanted = pi_5();
    unwanted.machine.cache = Cache::Unwanted;
    assert!(findings(&unwanted, None).iter().all(|f| f.check != "cache-folder"));
}

#[test]
fn lanes() {
    let pinned = |a, b| {
        let lanes = vec![lane("main", LaneKind::Cyclic, 40, a), lane("fast", LaneKind::Cyclic, 41, b)];
        Some(Needs { lanes, ..Needs::default() })
    };
    table(
        "lane-cpus",
        [
            ("there", pi_5(), pinned(Some(0), Some(3)), Status::Ok, "CPU 0,3 of 0-3"),
            ("not there", pi_5(), pinned(Some(0), Some(4)), Status::Bad, "cpu = 3  # in [lane.fast]"),
        ],
    );
    table(
        "lanes-per-cpu",
        [
            ("one each", pi_5(), pinned(Some(0), Some(3)), Status::Ok, "no two"),
            (
                "shared, an isolated one is free",
                pi_5(),
                pinned(Some(0), Some(0)),
                Status::Note,
                "cpu = 3  # in [lane.fast]",
            ),
            (
                "shared, an ordinary one is free",
                pi_5(),
                pinned(Some(3), Some(3)),
                Status::Note,
                "cpu = 0  # in [lane.fast]",
            ),
            ("shared, none is free", pi_4().cpus(1, "x"), pinned(Some(0), Some(0)), Status::Note, "# remove cpu"),
        ],
    );
    for check in ["lane-cpus", "lanes-per-cpu"] {
        assert!(findings(&pi_5(), pinned(None, None).as_ref()).iter().all(|f| f.check != check), "{check}");
    }
}

#[test]
fn lane_priorities() {
    let thread = |priority: u32| {
        // Fields 3 to 41 of /proc/PID/stat; 40 is the priority, 41 the policy.
        let fields = vec!["0"; 36].join(" ");
        let stat = |name: &str| format!("77 ({name}) S {fields} {priority} 1 0");
        pi_4().file("/proc/77/stat", &stat("irq/155-latchwo")).file("/proc/78/stat", "78 (a (b) c) S 1 2 3")
    };
    let poll = |main, poll| {
        let lanes = vec![lane("main", LaneKind::Cyclic, main, None), lane("poll", LaneKind::Poll, poll, None)];
        Some(Needs { lanes, ..Needs::default() })
    };
    table(
        "lane-priorities",
        [
            (
                "in order",
                pi_4(),
                Some(interlock(40, 45, None)),
                Status::Ok,
                "main 40, trip 45; the kernel's GPIO interrupt thread 50",
            ),
            (
                "the usual priority",
                pi_4(),
                Some(interlock(50, 45, None)),
                Status::Note,
                "priority = 40  # in [lane.main]",
            ),
            (
                "an interrupt lane too high",
                pi_4(),
                Some(interlock(40, 80, None)),
                Status::Note,
                "priority = 45  # in [lane.trip]",
            ),
            ("too high, but apart", pi_5(), Some(interlock(40, 80, Some(3))), Status::Ok, "trip 80"),
            (
                "too high, and interrupts come there",
                pi_5(),
                Some(interlock(40, 80, Some(2))),
                Status::Note,
                "trip (80) is not below",
            ),
            ("a raised interrupt thread", thread(90), Some(interlock(50, 80, None)), Status::Ok, "interrupt thread 90"),
            (
                "a lowered interrupt thread",
                thread(20),
                Some(interlock(30, 35, None)),
                Status::Note,
                "priority = 10  # in [lane.main]",
            ),
            ("an interrupt lane below", pi_4(), poll(60, 50), Status::Note, "priority = 65  # in [lane.poll]"),
            ("no edges: no interrupt thread", pi_4(), poll(60, 70), Status::Ok, "main 60, poll 70"),
            ("the highest", pi_4(), poll(60, 99), Status::Note, "priority = 98  # in [lane.poll]"),
        ],
    );
}
