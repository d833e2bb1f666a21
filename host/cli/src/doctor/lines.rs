//! The lines that a plant names: there, and held by nobody else.

use super::finding::{Finding, Status};
use super::gpio::{Device, device};
use super::machine::Machine;
use super::needs::{LineName, LineNeeds, Needs};
use super::numbers::join;
use latchwork_io::gpio::{ChipInfo, LineInfo};

/// Labels of the chip of a Raspberry Pi's pins.
const RASPBERRY: [&str; 3] = ["pinctrl-bcm2835", "pinctrl-bcm2711", "pinctrl-rp1"];
/// What holders that are plants begin with.
const OURS: &str = "latchwork";

/// The lines a plant names are there, and nobody holds them.
pub(super) fn holders(machine: &Machine, needs: Option<&Needs>) -> Vec<Finding> {
    const CHECK: &str = "gpio-lines";
    const WHY: &str =
        "A line has one holder: what another program or a driver of the kernel holds, a plant does not get.";
    let (mut absent, mut held, mut ours, mut free) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for wanted in needs.into_iter().flat_map(|n| &n.lines) {
        // A chip that is not there, or closed, is a finding of its own.
        let Some(chip) = chip(machine, wanted) else { continue };
        let shown = format!("{} of {} ({})", wanted.line, chip.path.display(), wanted.point);
        match line(chip, &wanted.line) {
            None => absent.push(shown),
            Some(line) if !line.used => free += 1,
            Some(line) if line.consumer.starts_with(OURS) => ours.push(format!("{shown} by \"{}\"", line.consumer)),
            Some(line) if line.consumer.is_empty() => held.push(format!("{shown} by somebody who gave no name")),
            Some(line) => held.push(format!("{shown} by \"{}\"", line.consumer)),
        }
    }
    let mut findings = Vec::new();
    let look = "latchwork gpio  # lists all lines, and who holds them";
    if !absent.is_empty() {
        let found = format!("not there: {}", join(&absent));
        findings.push(Finding::wanting(Status::Bad, CHECK, WHY, found, vec![look.into()]));
    }
    if !held.is_empty() {
        let mend = vec!["# end that program, or take another line".into(), look.into()];
        findings.push(Finding::wanting(Status::Bad, CHECK, WHY, format!("held: {}", join(&held)), mend));
    }
    if !ours.is_empty() {
        let found = format!("held by a plant that runs: {}", join(&ours));
        let mend = vec!["# as it should be if it is this one; another must be stopped first".into()];
        findings.push(Finding::wanting(Status::Note, CHECK, WHY, found, mend));
    }
    if findings.is_empty() && free > 0 {
        let lines = if free == 1 { "the line".into() } else { format!("all {free} lines") };
        findings.push(Finding::ok(CHECK, WHY, format!("{lines} that the plant names can be had")));
    }
    findings
}

/// The chip of a line, if this user may read it.
fn chip<'a>(machine: &'a Machine, wanted: &LineNeeds) -> Option<&'a ChipInfo> {
    let Some(name) = &wanted.chip else {
        return machine.chips.iter().find(|c| RASPBERRY.contains(&c.label.as_str()));
    };
    match device(machine, name) {
        Device::Chip(path) => machine.chips.iter().find(|c| c.path == path),
        _ => None,
    }
}

fn line<'a>(chip: &'a ChipInfo, name: &LineName) -> Option<&'a LineInfo> {
    chip.lines.iter().find(|line| match name {
        LineName::Number(number) => line.number == *number,
        LineName::Name(name) => line.name == *name,
    })
}
