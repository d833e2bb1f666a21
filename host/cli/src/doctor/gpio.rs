//! General-purpose inputs and outputs: chips of the character device, and a Raspberry Pi's registers.

use super::access::{allow, rights};
use super::finding::{Finding, Status};
use super::machine::{Machine, Node};
use super::needs::Needs;
use super::numbers::join;
use std::path::{Path, PathBuf};

/// GPIO chips are there and may be used.
pub(super) fn chips(machine: &Machine, needs: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "gpio-chips";
    const WHY: &str = "Drivers of kind gpio and rppal ask the kernel for lines and edges through these devices.";
    // A chip has one line here, whatever links lead to it.
    let is_chip =
        |path: &PathBuf, node: &Node| *path == node.real && path.to_string_lossy().starts_with("/dev/gpiochip");
    let there: Vec<(&PathBuf, &Node)> = machine.nodes.iter().filter(|(p, node)| is_chip(p, node)).collect();
    let needed = needs.is_some_and(|n| !n.gpio.is_empty() || !n.rppal.is_empty());
    let mut findings = Vec::new();
    for (driver, chip) in needs.into_iter().flat_map(|n| &n.gpio) {
        let found = match chip.as_deref().map(|chip| (chip, device(machine, chip))) {
            Some((chip, Device::Absent)) if chip.contains('/') || !there.is_empty() => {
                let here = if machine.chips.is_empty() { String::new() } else { format!("; {}", here(machine)) };
                format!("{chip}, which driver {driver} names, is not there{here}")
            }
            Some((chip, Device::Several(paths))) => {
                format!("{} have the label {chip}, which driver {driver} names: name a path", join(&paths))
            }
            _ => continue,
        };
        let mend = vec!["latchwork gpio  # lists what is there".into()];
        findings.push(Finding::wanting(Status::Bad, CHECK, WHY, found, mend));
    }
    if there.is_empty() && findings.is_empty() {
        let found = "no /dev/gpiochip*";
        findings.push(match needed || machine.is_raspberry() {
            true => {
                let mend = match machine.is_container() {
                    true => vec!["docker run --device=/dev/gpiochip0 …".into()],
                    false => vec!["sudo dmesg | grep -iE 'gpio|pinctrl'  # why the kernel found none".into()],
                };
                Finding::wanting(Status::bad_if(needed), CHECK, WHY, found, mend)
            }
            false => Finding::ok(CHECK, WHY, "none here, and none needed"),
        });
    }
    let (open, closed): (Vec<_>, Vec<_>) = there.into_iter().partition(|(_, node)| node.read && node.write);
    let names = |nodes: &[(&PathBuf, &Node)]| {
        join(&nodes.iter().map(|(path, _)| path.display().to_string()).collect::<Vec<_>>())
    };
    if let Some((path, node)) = closed.first() {
        let nodes: Vec<&Node> = closed.iter().map(|(_, node)| *node).collect();
        let status = Status::bad_if(lacks(machine, needs, &nodes, !open.is_empty()));
        let found = format!("{} {}", names(&closed), rights(node));
        findings.push(Finding::wanting(status, CHECK, WHY, found, allow(machine, path, node, "gpio")));
    } else if !open.is_empty() && findings.is_empty() {
        findings.push(Finding::ok(CHECK, WHY, format!("{} may be read and written", names(&open))));
    }
    findings
}

/// What a plant file's `chip` means on a machine.
pub(super) enum Device {
    /// This chip.
    Chip(PathBuf),
    /// Chips of one label.
    Several(Vec<String>),
    /// Nothing.
    Absent,
    /// It may be one of those that are closed to this user.
    Unknown,
}

/// The device a plant file's `chip` means: a path, a name or a label, as the driver has it.
pub(super) fn device(machine: &Machine, chip: &str) -> Device {
    let numbered =
        chip.strip_prefix("gpiochip").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    if chip.contains('/') || numbered {
        let path = if numbered { Path::new("/dev").join(chip) } else { PathBuf::from(chip) };
        return machine.nodes.get(&path).map_or(Device::Absent, |node| Device::Chip(node.real.clone()));
    }
    let labelled: Vec<&PathBuf> =
        machine.chips.iter().filter(|c| c.label == chip || c.name == chip).map(|c| &c.path).collect();
    let closed = |path: &PathBuf| path.to_string_lossy().starts_with("/dev/gpiochip") && !opened(machine, path);
    match labelled[..] {
        [one] => Device::Chip(one.clone()),
        [] if machine.nodes.keys().any(closed) => Device::Unknown,
        [] => Device::Absent,
        _ => Device::Several(labelled.iter().map(|p| p.display().to_string()).collect()),
    }
}

/// A chip could be read.
fn opened(machine: &Machine, path: &PathBuf) -> bool {
    let real = machine.nodes.get(path).map_or(path, |node| &node.real);
    machine.chips.iter().any(|c| c.path == *real)
}

/// The chips there are.
fn here(machine: &Machine) -> String {
    let chips: Vec<String> = machine.chips.iter().map(|c| format!("{} (\"{}\")", c.path.display(), c.label)).collect();
    format!("here is {}", join(&chips))
}

/// A plant needs one of the chips that are closed to it. Where it does not say which it uses, any open one may be it.
fn lacks(machine: &Machine, needs: Option<&Needs>, closed: &[&Node], some_open: bool) -> bool {
    let Some(needs) = needs else { return false };
    let mut unnamed = !needs.rppal.is_empty();
    for (_, chip) in &needs.gpio {
        match chip.as_deref().map(|chip| device(machine, chip)) {
            Some(Device::Chip(path)) if closed.iter().any(|node| node.real == path) => return true,
            Some(Device::Unknown) => return true,
            None => unnamed = true,
            _ => {}
        }
    }
    unnamed && !some_open
}

/// A Raspberry Pi's GPIO registers may be mapped.
pub(super) fn registers(machine: &Machine, needs: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "gpio-registers";
    const WHY: &str = "A driver of kind rppal reads and writes levels in the registers themselves.";
    let needed = needs.is_some_and(|n| !n.rppal.is_empty());
    let wanting = |found, mend| vec![Finding::wanting(Status::bad_if(needed), CHECK, WHY, found, mend)];
    let model = machine.model();
    if !machine.is_raspberry() {
        let driver = needs.and_then(|n| n.rppal.first());
        return driver.map_or(Vec::new(), |driver| {
            let mend = vec![format!("kind = \"gpio\"  # in [driver.{driver}]: it works on any board")];
            wanting("no Raspberry Pi: rppal works on nothing else".into(), mend)
        });
    }
    // The RP1 of the fifth generation has its registers elsewhere.
    let fifth = ["Raspberry Pi 5", "Compute Module 5"].iter().any(|m| model.contains(m));
    let path = Path::new(if fifth { "/dev/gpiomem0" } else { "/dev/gpiomem" });
    match machine.nodes.get(path) {
        Some(node) if node.read && node.write => {
            vec![Finding::ok(CHECK, WHY, format!("{} may be read and written", path.display()))]
        }
        Some(node) => wanting(format!("{} {}", path.display(), rights(node)), allow(machine, path, node, "gpio")),
        None => {
            let mend = match needs.and_then(|n| n.rppal.first()) {
                Some(driver) => {
                    vec![format!("kind = \"gpio\"  # in [driver.{driver}]: it needs no {}", path.display())]
                }
                None => Vec::new(),
            };
            wanting(format!("no {}: only kernels made for this board have it", path.display()), mend)
        }
    }
}
