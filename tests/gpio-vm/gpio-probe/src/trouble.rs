//! Lines and chips that cannot be had, go away and come back.

use crate::bench::{Lane, number, point, text, wait};
use crate::chip::Chip;
use crate::{Outcome, ensure};
use gpiocdev::Request;
use gpiocdev::line::Value;
use latchwork_io::direct::Role;
use latchwork_io::driver::PointConfig;
use std::os::unix::fs::{PermissionsExt, chown};
use std::os::unix::process::CommandExt;
use std::process::{Command, ExitCode};
use std::time::Duration;

fn edge(name: &str, line: usize) -> (PointConfig, Role) {
    (point(name, &[("line", number(line))], None), Role::Edge)
}

fn level(name: &str, line: usize) -> (PointConfig, Role) {
    (point(name, &[("line", number(line))], None), Role::Level)
}

fn output(name: &str, line: usize) -> (PointConfig, Role) {
    (point(name, &[("line", number(line))], Some(false)), Role::Output)
}

/// Somebody else who holds a line.
fn holder(chip: &Chip, line: u32, name: &str) -> Result<Request, String> {
    let mut builder = Request::builder();
    builder.on_chip(&chip.device).with_line(line).as_output(Value::Inactive).with_consumer(name);
    builder.request().map_err(|e| e.to_string())
}

pub(crate) fn held() -> Outcome {
    let chip = Chip::new("held", 6, &[])?;
    let door = holder(&chip, 1, "door-bell")?;
    let relay = holder(&chip, 3, "relay-box")?;
    let points = vec![
        edge("window", 0),
        edge("door", 1),
        output("lamp", 2),
        output("horn", 3),
        output("pump", 4),
        level("key", 5),
    ];
    let mut lane = Lane::open(&chip.path(), points)?;
    let good: Vec<bool> = (0..6).map(|n| lane.direct.good(n)).collect();
    ensure!(good == [true, false, true, false, true, true] && !lane.direct.healthy(), "good: {good:?}");
    let told = lane.told();
    ensure!(told.len() == 3, "events: {told:#?}");
    let says =
        |who: &str, name: &str| told.iter().any(|t| t.starts_with(who) && t.contains(&format!("held by \"{name}\"")));
    ensure!(says("gpio.door refused", "door-bell") && says("gpio.horn refused", "relay-box"), "events: {told:#?}");
    ensure!(told.iter().any(|t| t.starts_with("gpio connected")), "events: {told:#?}");
    lane.reopen();
    lane.reopen();
    ensure!(lane.events.is_empty(), "told again: {:#?}", lane.told());
    // Those that are free work.
    lane.write(&[true, true, true]);
    ensure!(chip.value(2) && !chip.value(3) && chip.value(4), "the free outputs do not work");
    chip.pull(0, true);
    ensure!(lane.edges(0).len() == 1 && lane.edges(1).is_empty(), "the free input does not work");
    // Another holder is another reason.
    drop(door);
    let bell = holder(&chip, 1, "second-bell")?;
    lane.reopen();
    let told = lane.told();
    ensure!(told.len() == 1 && told[0].contains("second-bell"), "events: {told:#?}");
    drop((bell, relay));
    lane.reopen();
    let told = lane.transitions();
    let expected = [("gpio.door".to_owned(), "accepted"), ("gpio.horn".to_owned(), "accepted")];
    ensure!(lane.direct.healthy() && told == expected, "events: {told:?}");
    lane.write(&[true, true, true]);
    ensure!(chip.value(2) && chip.value(3) && chip.value(4), "the outputs do not work");
    Ok(())
}

pub(crate) fn wrong_lines() -> Outcome {
    let chip = Chip::new("wrong", 4, &[(0, "TWIN"), (1, "TWIN"), (2, "DOOR")])?;
    let named = |name: &str, line: &str| (point(name, &[("line", text(line))], None), Role::Level);
    let points = vec![
        level("far", 4),
        named("twin", "TWIN"),
        named("typo", "DOR"),
        named("door", "DOOR"),
        level("door-again", 2),
        edge("fine", 3),
    ];
    let mut lane = Lane::open(&chip.path(), points)?;
    let good: Vec<bool> = (0..6).map(|n| lane.direct.good(n)).collect();
    ensure!(good == [false, false, false, true, false, true], "good: {good:?}");
    lane.reopen();
    let told = lane.told();
    for (who, what) in [
        ("gpio.far refused", "lines 0 to 3"),
        ("gpio.twin refused", "lines 0 and 1 are both named"),
        ("gpio.typo refused", "did you mean \"DOOR\"?"),
        ("gpio.door-again refused", "the line of `door` already"),
        ("gpio connected", "`door`, `fine`"),
    ] {
        ensure!(told.iter().any(|t| t.starts_with(who) && t.contains(what)), "no {who} with {what}: {told:#?}");
    }
    ensure!(told.len() == 5, "events: {told:#?}");
    Ok(())
}

pub(crate) fn unplugged() -> Outcome {
    let mut chip = Chip::new("plug", 3, &[])?;
    let mut lane = Lane::open("plug", vec![edge("door", 0), output("trip", 1), level("key", 2)])?;
    let first = lane.told();
    ensure!(first.len() == 1 && first[0].starts_with("gpio connected"), "at first: {first:#?}");
    for round in 0..3 {
        lane.write(&[true]);
        ensure!(lane.direct.healthy() && chip.value(1), "round {round}: the output is not driven");
        chip.pull(0, true);
        chip.pull(2, true);
        let edges = lane.edges(0);
        ensure!(edges.len() == 1 && edges[0].missed == 0, "round {round}: {edges:?}");
        ensure!(lane.level(2) == Some(true), "round {round}: level {:?}", lane.level(2));
        chip.unplug();
        // Whatever is done first finds it out.
        match round {
            0 => ensure!(lane.edges(0).is_empty(), "edges of a chip that is gone"),
            1 => ensure!(lane.level(2).is_none(), "a level of a chip that is gone"),
            _ => lane.write(&[false]),
        }
        ensure!(!lane.direct.healthy() && (0..3).all(|n| !lane.direct.good(n)), "round {round}: still good");
        ensure!(lane.direct.descriptor(0).is_none(), "round {round}: a descriptor of a chip that is gone");
        for _ in 0..3 {
            lane.reopen();
            lane.write(&[false]);
            ensure!(lane.level(0).is_none() && lane.edges(0).is_empty(), "round {round}: something works");
        }
        let told = lane.transitions();
        ensure!(told == [("gpio".to_owned(), "lost")], "round {round}: {told:?}");
        chip.plug().map_err(|e| e.to_string())?;
        lane.reopen();
        let told = lane.transitions();
        ensure!(lane.direct.healthy() && told == [("gpio".to_owned(), "connected")], "round {round}: {told:?}");
        ensure!(!chip.value(1), "round {round}: the output does not begin safe");
    }
    Ok(())
}

/// Nothing is read, and what is written has been written before.
pub(crate) fn outputs_alone() -> Outcome {
    let mut chip = Chip::new("alone", 2, &[])?;
    let mut lane = Lane::open("alone", vec![output("trip", 0), output("lamp", 1)])?;
    lane.write(&[true, false]);
    lane.idle();
    let told = lane.transitions();
    ensure!(lane.direct.healthy() && told.len() == 1, "a chip that is there is lost: {told:?}");
    chip.unplug();
    lane.write(&[true, false]);
    lane.idle();
    lane.idle();
    let told = lane.transitions();
    ensure!(!lane.direct.healthy() && told == [("gpio".to_owned(), "lost")], "events: {told:?}");
    chip.plug().map_err(|e| e.to_string())?;
    lane.reopen();
    lane.write(&[true, false]);
    let told = lane.transitions();
    ensure!(lane.direct.healthy() && told == [("gpio".to_owned(), "connected")], "events: {told:?}");
    ensure!(chip.value(0) && !chip.value(1), "the outputs are not driven again");
    Ok(())
}

/// A chip that is away is not looked for every second, and another trouble is.
pub(crate) fn pauses() -> Outcome {
    let mut chip = Chip::new("pauses", 1, &[])?;
    let mut lane = Lane::open("pauses", vec![output("trip", 0)])?;
    chip.unplug();
    lane.idle();
    // Tries at 0, 2, 6 and 14 s.
    for _ in 0..7 {
        lane.direct.open(&mut |e| lane.events.push(e));
    }
    chip.plug().map_err(|e| e.to_string())?;
    for second in 7..15 {
        ensure!(!lane.direct.healthy(), "the chip was looked for after {} s", second - 1);
        lane.direct.open(&mut |e| lane.events.push(e));
    }
    ensure!(lane.direct.healthy(), "the chip was not looked for after 14 s");
    Ok(())
}

pub(crate) fn unplugged_while_waiting() -> Outcome {
    let mut chip = Chip::new("waiting", 1, &[])?;
    let mut lane = Lane::healthy(&chip, vec![edge("door", 0)])?;
    let woken = std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(Duration::from_millis(100));
            chip.unplug();
        });
        wait(lane.direct.descriptor(0).expect("it is open"), Duration::from_secs(2))
    });
    println!("note: waiting for a chip that is unplugged ends with {woken:?}");
    ensure!(lane.edges(0).is_empty() && !lane.direct.healthy(), "the lane did not notice");
    Ok(())
}

pub(crate) fn no_permission() -> Outcome {
    let chip = Chip::new("rights", 1, &[])?;
    let as_user = |group: u32, key: &str| -> Result<String, String> {
        let mut command = Command::new("/proc/self/exe");
        let output = command.args(["as-a-user", key]).uid(1000).gid(group).output().map_err(|e| e.to_string())?;
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    };
    for key in [&chip.path(), "rights"] {
        let told = as_user(1000, key)?;
        ensure!(told.starts_with("gpio refused") && told.contains("60-gpio.rules"), "root's own chip, {key}: {told}");
    }
    let _ = std::fs::create_dir("/etc");
    std::fs::write("/etc/group", "root:x:0:\ngpio:x:997:\n").map_err(|e| e.to_string())?;
    let mode = std::fs::Permissions::from_mode(0o660);
    std::fs::set_permissions(&chip.device, mode)
        .and_then(|()| chown(&chip.device, None, Some(997)))
        .map_err(|e| e.to_string())?;
    let told = as_user(1000, &chip.path())?;
    ensure!(told.contains("usermod -aG gpio USER"), "a group's chip: {told}");
    let told = as_user(997, &chip.path())?;
    ensure!(told.starts_with("gpio connected"), "as a member of the group: {told}");
    Ok(())
}

/// What a user without rights is told, twice.
pub(crate) fn as_a_user() -> ExitCode {
    let chip = std::env::args().nth(2).unwrap_or_default();
    let mut lane = Lane::open(&chip, vec![edge("door", 0)]).expect("the configuration is right");
    lane.reopen();
    println!("{}", lane.told().join("\n"));
    ExitCode::SUCCESS
}

pub(crate) fn label_twice() -> Outcome {
    let _first = Chip::new("same@1", 1, &[])?;
    let second = Chip::new("same@2", 1, &[])?;
    let mut lane = Lane::open("same", vec![edge("door", 0)])?;
    let told = lane.told();
    ensure!(told.len() == 1 && told[0].contains("have the label \"same\""), "events: {told:#?}");
    drop(second);
    lane.reopen();
    ensure!(lane.direct.healthy(), "one chip is left, and it is not taken: {:#?}", lane.told());
    Ok(())
}

pub(crate) fn list() -> Outcome {
    let chip = Chip::new("list", 4, &[(1, "DOOR")])?;
    let _other = holder(&chip, 3, "relay-box")?;
    let _lane = Lane::healthy(&chip, vec![edge("door", 1), output("trip", 2)])?;
    let everything = latchwork_io::gpio::list(None);
    ensure!(everything.unreadable.is_empty() && everything.chips.len() == 1, "{everything:?}");
    let by_label = latchwork_io::gpio::list(Some("list"));
    let found = by_label.chips.first().ok_or("the chip is not found by its label")?;
    ensure!(found.path == chip.device && found.label == "list" && found.lines.len() == 4, "{found:?}");
    let line = |n: usize| (found.lines[n].direction, found.lines[n].used, found.lines[n].consumer.as_str());
    let lines: Vec<_> = (0..4).map(line).collect();
    let expected = [
        ("input", false, ""),
        ("input", true, "latchwork gpio.door"),
        ("output", true, "latchwork gpio.trip"),
        ("output", true, "relay-box"),
    ];
    ensure!(lines == expected, "{lines:?}");
    ensure!(found.lines[1].name == "DOOR" && found.lines[1].edge == Some("both"), "{:?}", found.lines[1]);
    let absent = latchwork_io::gpio::list(Some("gpiochip99"));
    ensure!(absent.chips.is_empty() && absent.unreadable[0].why.contains("(\"list\")"), "{absent:?}");
    Ok(())
}
