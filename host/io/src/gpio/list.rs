//! Chips, lines and who holds them, for people.

use super::chip::{Trouble, find, paths, words};
use gpiocdev::chip::Chip;
use gpiocdev::line::{Bias, Direction, Drive, EdgeDetection};
use std::path::PathBuf;
use std::time::Duration;

/// A chip.
#[derive(Clone, Debug)]
pub struct ChipInfo {
    /// Its device, such as `/dev/gpiochip0`.
    pub path: PathBuf,
    /// The kernel's name of it, such as `gpiochip0`.
    pub name: String,
    /// What it is, such as `pinctrl-bcm2711`.
    pub label: String,
    /// Its lines in the order of their numbers.
    pub lines: Vec<LineInfo>,
}

/// A line, in the words a plant file uses for it.
#[derive(Clone, Debug)]
pub struct LineInfo {
    /// Number on its chip.
    pub number: u32,
    /// Name; empty for many lines.
    pub name: String,
    /// `input` or `output`.
    pub direction: &'static str,
    /// Low voltage is true.
    pub active_low: bool,
    /// `pull-up`, `pull-down` or `disabled`; `None` when nobody set it.
    pub bias: Option<&'static str>,
    /// `both`, `rising` or `falling`, while somebody takes its edges.
    pub edge: Option<&'static str>,
    /// `push-pull`, `open-drain` or `open-source`, of an output.
    pub drive: Option<&'static str>,
    /// How long a level must last.
    pub debounce: Option<Duration>,
    /// Somebody holds it.
    pub used: bool,
    /// The name its holder gave; may be empty.
    pub consumer: String,
}

/// A chip that cannot be opened.
#[derive(Clone, Debug)]
pub struct Unreadable {
    /// Its device, or how it was asked for.
    pub chip: String,
    /// Why, and what helps.
    pub why: String,
}

/// The chips of a machine.
#[derive(Clone, Debug, Default)]
pub struct Listing {
    /// Those that can be read.
    pub chips: Vec<ChipInfo>,
    /// Those that cannot.
    pub unreadable: Vec<Unreadable>,
}

/// Reads the state of all chips, or of the one with this path, name or label. Takes and changes no line.
pub fn list(chip: Option<&str>) -> Listing {
    let mut listing = Listing::default();
    let opened: Vec<(String, Result<Chip, Trouble>)> = match chip {
        Some(key) => vec![(key.to_owned(), find(key))],
        None => paths().into_iter().map(|p| p.display().to_string()).map(|p| (p.clone(), find(&p))).collect(),
    };
    for (name, chip) in opened {
        match chip.map_err(|t| t.text()).and_then(|c| read(&c).map_err(|e| words(&e))) {
            Ok(info) => listing.chips.push(info),
            Err(why) => listing.unreadable.push(Unreadable { chip: name, why }),
        }
    }
    listing
}

fn read(chip: &Chip) -> gpiocdev::Result<ChipInfo> {
    let info = chip.info()?;
    let lines = chip.line_info_iter()?.map(|line| line.map(line_info)).collect::<gpiocdev::Result<_>>()?;
    Ok(ChipInfo { path: chip.path().to_path_buf(), name: info.name, label: info.label, lines })
}

fn line_info(info: gpiocdev::line::Info) -> LineInfo {
    let output = info.direction == Direction::Output;
    LineInfo {
        number: info.offset,
        name: info.name,
        direction: if output { "output" } else { "input" },
        active_low: info.active_low,
        bias: info.bias.map(|b| match b {
            Bias::PullUp => "pull-up",
            Bias::PullDown => "pull-down",
            Bias::Disabled => "disabled",
        }),
        edge: info.edge_detection.map(|e| match e {
            EdgeDetection::BothEdges => "both",
            EdgeDetection::RisingEdge => "rising",
            EdgeDetection::FallingEdge => "falling",
        }),
        drive: info.drive.filter(|_| output).map(|d| match d {
            Drive::PushPull => "push-pull",
            Drive::OpenDrain => "open-drain",
            Drive::OpenSource => "open-source",
        }),
        debounce: info.debounce_period.filter(|d| !d.is_zero()),
        used: info.used,
        consumer: info.consumer,
    }
}
