//! `latchwork gpio`

use crate::Exit;
use crate::args::Gpio;
use crate::report;
use anyhow::Result;
use comfy_table::{Table, presets};
use latchwork_image::format_duration;
use latchwork_io::gpio::{ChipInfo, LineInfo, list};
use serde_json::{Value, json};

/// What to do on a machine without chips.
const NONE: &str = "\
this machine has no GPIO character device (/dev/gpiochip*)
  On a Raspberry Pi or another board it comes with the board's own Linux kernel: is this a container, a virtual machine
  or another kernel? A container needs the device handed in, as in `docker run --device /dev/gpiochip0`. On a PC a
  USB adapter whose driver is in the kernel (FT232H, CP2112, MCP2221) brings one. Without one, try a plant with `run --sim`.";

pub(super) fn execute(args: &Gpio) -> Result<Exit> {
    let listing = list(args.chip.as_deref());
    if args.json {
        let chips: Vec<Value> = listing.chips.iter().map(chip_json).collect();
        report::say(&format!("{}\n", serde_json::to_string_pretty(&chips)?));
    } else {
        let shown: Vec<String> = listing.chips.iter().map(show).collect();
        report::say(&shown.join("\n"));
    }
    for chip in &listing.unreadable {
        report::error(&anyhow::anyhow!("{}", chip.why));
    }
    if listing.chips.is_empty() && listing.unreadable.is_empty() {
        report::error(&anyhow::anyhow!(NONE));
    }
    Ok(if listing.chips.is_empty() || !listing.unreadable.is_empty() { Exit::Wanting } else { Exit::Fine })
}

/// A chip and its lines.
fn show(chip: &ChipInfo) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["line", "name", "direction", "active-low", "bias", "edge", "debounce", "drive", "held by"]);
    for line in &chip.lines {
        let or_dash = |text: Option<&str>| text.filter(|t| !t.is_empty()).unwrap_or("-").to_owned();
        table.add_row([
            line.number.to_string(),
            or_dash(Some(&line.name)),
            line.direction.to_owned(),
            or_dash(line.active_low.then_some("yes")),
            or_dash(line.bias),
            or_dash(line.edge),
            or_dash(debounce(line).as_deref()),
            or_dash(line.drive),
            or_dash(Some(holder(line))),
        ]);
    }
    let label = if chip.label.is_empty() { String::new() } else { format!(", label \"{}\"", chip.label) };
    format!("{} ({}{label}): {} lines\n{table}\n", chip.path.display(), chip.name, chip.lines.len())
}

/// Who holds a line.
fn holder(line: &LineInfo) -> &str {
    match (line.used, line.consumer.as_str()) {
        (false, _) => "",
        (true, "") => "(no name given)",
        (true, name) => name,
    }
}

fn debounce(line: &LineInfo) -> Option<String> {
    line.debounce.map(|d| format_duration(d.as_nanos() as u64))
}

fn chip_json(chip: &ChipInfo) -> Value {
    let lines = chip.lines.iter().map(|line| {
        json!({
            "line": line.number,
            "name": line.name,
            "direction": line.direction,
            "active-low": line.active_low,
            "bias": line.bias,
            "edge": line.edge,
            "debounce": debounce(line),
            "drive": line.drive,
            "used": line.used,
            "held-by": line.consumer,
        })
    });
    json!({
        "path": chip.path.display().to_string(),
        "name": chip.name,
        "label": chip.label,
        "lines": lines.collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_chip_is_shown_as_people_and_as_programs_read_it() {
        let free = LineInfo {
            number: 0,
            name: String::new(),
            direction: "input",
            active_low: false,
            bias: None,
            edge: None,
            drive: None,
            debounce: None,
            used: false,
            consumer: String::new(),
        };
        let door = LineInfo {
            number: 17,
            name: "GPIO17".into(),
            active_low: true,
            bias: Some("pull-up"),
            edge: Some("both"),
            debounce: Some(Duration::from_millis(5)),
            used: true,
            consumer: "latchwork gpio.door".into(),
            ..free.clone()
        };
        let trip = LineInfo {
            number: 27,
            name: "GPIO27".into(),
            direction: "output",
            drive: Some("push-pull"),
            used: true,
            ..free.clone()
        };
        let chip = ChipInfo {
            path: "/dev/gpiochip0".into(),
            name: "gpiochip0".into(),
            label: "pinctrl-bcm2711".into(),
            lines: vec![free, door, trip],
        };
        let json = serde_json::to_string_pretty(&chip_json(&chip)).expect("plain values");
        // Padding to the right of the last column is no matter.
        let shown: Vec<String> = show(&chip).lines().map(|l| l.trim_end().to_owned()).collect();
        insta::assert_snapshot!(format!("{}\n\n{json}", shown.join("\n")));
    }
}
