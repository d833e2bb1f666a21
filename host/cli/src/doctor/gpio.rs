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
    let there: Vec<(&PathBuf, &Node)> =
        machine.nodes.iter().filter(|(p, _)| p.to_string_lossy().starts_with("/dev/gpiochip")).collect();
    let needed = needs.is_some_and(|n| !n.gpio.is_empty() || !n.rppal.is_empty());
    let mut findings = Vec::new();
    let named =
        needs.into_iter().flat_map(|n| &n.gpio).filter_map(|(driver, chip)| Some((driver, device(chip.as_ref()?)?)));
    for (driver, path) in named {
        if !machine.nodes.contains_key(&path) {
            let found = format!("{}, which driver {driver} names, is not there", path.display());
            findings.push(Finding::wanting(
                Status::Bad,
                CHECK,
                WHY,
                found,
                vec!["latchwork gpio  # lists what is there".into()],
            ));
        }
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
        let status =
            Status::bad_if(lacks(needs, &closed.iter().map(|(p, _)| *p).collect::<Vec<_>>(), !open.is_empty()));
        let found = format!("{} {}", names(&closed), rights(node));
        findings.push(Finding::wanting(status, CHECK, WHY, found, allow(machine, path, node, "gpio")));
    } else if !open.is_empty() && findings.is_empty() {
        findings.push(Finding::ok(CHECK, WHY, format!("{} may be read and written", names(&open))));
    }
    findings
}

/// The device a plant file's `chip` means, if it is not a label.
fn device(chip: &str) -> Option<PathBuf> {
    match chip {
        c if c.starts_with('/') => Some(PathBuf::from(c)),
        c if c.starts_with("gpiochip") => Some(Path::new("/dev").join(c)),
        _ => None,
    }
}

/// A plant needs one of the chips that are closed to it. Where it does not say which it uses, any open one may be it.
fn lacks(needs: Option<&Needs>, closed: &[&PathBuf], some_open: bool) -> bool {
    let Some(needs) = needs else { return false };
    let devices: Vec<Option<PathBuf>> = needs.gpio.iter().map(|(_, c)| c.as_deref().and_then(device)).collect();
    let unnamed = !needs.rppal.is_empty() || devices.contains(&None);
    (unnamed && !some_open) || devices.into_iter().flatten().any(|d| closed.contains(&&d))
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
