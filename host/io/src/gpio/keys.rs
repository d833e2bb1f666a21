//! The kind, its keys and their checks.

use super::direct::Lane;
use super::session::session;
use super::settings::{Select, Settings};
use crate::direct::{Direct, Role};
use crate::driver::{Driver, DriverConfig, DriverKind, PointConfig, PointShape, Problem};
use latchwork_image::{Type, parse_duration};
use latchwork_schema::{Key, Kind, Section, Values};
use std::collections::HashMap;
use std::time::Duration;

const US: u64 = 1_000;
const MS: u64 = 1_000 * US;
const SECOND: u64 = 1_000 * MS;

/// Lines of the GPIO character device.
pub(crate) static GPIO: DriverKind = DriverKind {
    name: "gpio",
    keys: &DRIVER_SECTION,
    point_keys: &POINT_SECTION,
    point,
    check,
    build,
    direct: Some(build_direct),
};

static DRIVER_SECTION: Section = Section {
    name: "driver (gpio)",
    doc: "Lines of a GPIO chip, through the character device of Linux. Points of an interrupt lane are served by that \
          lane itself, the others every `every`. `latchwork gpio` lists chips and lines.",
    keys: &[
        Key::required(
            "chip",
            Kind::Text,
            "The chip: its path \"/dev/gpiochip0\", its name \"gpiochip0\" or its label, as in \"pinctrl-bcm2711\". A \
             label stays when the kernel numbers its chips anew.",
        ),
        EVERY,
    ],
};

const EVERY: Key = Key::optional(
    "every",
    Kind::Duration { min: MS, max: 60 * SECOND },
    "\"5ms\"",
    "How often the points that belong to no interrupt lane are read and written.",
);

static POINT_SECTION: Section = Section {
    name: "point (gpio)",
    doc: "One line of the chip, a bool. With `from` it is an output, otherwise an input.",
    keys: &[
        Key::required(
            "line",
            Kind::Either(&Kind::Integer { min: 0, max: 65535 }, &Kind::Text),
            "Number of the line on its chip, or its name, as in \"GPIO17\"; the name must be there once.",
        ),
        Key::optional(
            "bias",
            Kind::OneOf(&["as-is", "pull-up", "pull-down", "disabled"]),
            "\"as-is\"",
            "Resistor inside the chip. Chips that have none ignore it.",
        ),
        Key::optional(
            "active-low",
            Kind::Bool,
            "false",
            "The line is true when its voltage is low. Everything else here (edges, `safe`, `initial`) is about the \
             logical level.",
        ),
        Key::optional(
            "debounce",
            Kind::Duration { min: US, max: SECOND },
            "",
            "Inputs: a level counts once it has lasted this long. Without it every edge counts.",
        ),
        Key::optional(
            "edge",
            Kind::OneOf(&["both", "rising", "falling"]),
            "\"both\"",
            "Inputs that start an interrupt lane: which of their edges do.",
        ),
        BUFFER,
        Key::optional(
            "drive",
            Kind::OneOf(&["push-pull", "open-drain", "open-source"]),
            "\"push-pull\"",
            "Outputs: which levels are driven. Open-drain drives only low, open-source only high.",
        ),
        Key::optional(
            "initial",
            Kind::Bool,
            "",
            "Outputs: level from the moment the line is taken until the plant writes it. Without it the safe value.",
        ),
    ],
};

/// The kernel keeps at most 1024 edges of a line, whatever it is asked for (`GPIO_V2_LINES_MAX * 16`): a larger number
/// would be a promise nobody keeps.
pub(super) const BUFFER: Key = Key::optional(
    "buffer",
    Kind::Integer { min: 16, max: 1024 },
    "1024",
    "Inputs that start an interrupt lane: edges the kernel keeps until the lane takes them, rounded up to a power of \
     two. Beyond that the oldest are lost, and a record says how many.",
);

const INPUT_ONLY: [&str; 3] = ["debounce", "edge", "buffer"];
const OUTPUT_ONLY: [&str; 2] = ["drive", "initial"];

/// The default of an integer key.
pub(super) fn default_integer(key: &Key) -> i64 {
    key.default.parse().unwrap_or_default()
}

/// How often the I/O thread's part is at work.
pub(super) fn every(values: &Values) -> Duration {
    let default = || parse_duration(EVERY.default.trim_matches('"')).unwrap_or(5 * MS);
    Duration::from_nanos(values.duration(EVERY.name).unwrap_or_else(default))
}

fn point(values: &Values) -> Result<PointShape, Vec<Problem>> {
    match Settings::of(values) {
        Some(_) => Ok(PointShape { ty: Type::Bool, writable: true, readable: true }),
        None => Err(vec![Problem {
            point: None,
            key: if values.has("line") { "line".into() } else { String::new() },
            message: "the point names no line of the chip".into(),
            help: Some("name it by number or name, as in line = 17 or line = \"GPIO17\"; see `latchwork gpio`".into()),
        }]),
    }
}

fn check(config: &DriverConfig) -> Vec<Problem> {
    let mut problems = Vec::new();
    if config.values.text("chip").is_some_and(|c| c.trim().is_empty()) {
        problems.push(Problem {
            point: None,
            key: "chip".into(),
            message: "the chip has no name".into(),
            help: Some(
                "name it, as in chip = \"/dev/gpiochip0\"; `latchwork gpio` lists the chips of a machine".into(),
            ),
        });
    }
    let mut seen: HashMap<Select, &PointConfig> = HashMap::new();
    for point in &config.points {
        problems.extend(wrong_way(point));
        let Some(settings) = Settings::of(&point.values) else { continue };
        if let Some(first) = seen.get(&settings.select) {
            problems.push(Problem {
                point: Some(point.name.clone()),
                key: "line".into(),
                message: format!("`{}` is {} too: a line has one point", first.name, settings.select),
                help: Some(if first.safe.is_some() || point.safe.is_some() {
                    format!("choose another line for `{}`, or remove one of the two points", point.name)
                } else {
                    format!("choose another line for `{}`, or let both readers name `{}`", point.name, first.name)
                }),
            });
        } else {
            seen.insert(settings.select, point);
        }
    }
    problems
}

/// Keys that make no sense for the way the point goes.
fn wrong_way(point: &PointConfig) -> impl Iterator<Item = Problem> {
    let output = point.safe.is_some();
    let (keys, is, other): (&[&str], _, _) = if output {
        (&INPUT_ONLY, "an output (it has `from`)", "take `from` away to make it an input")
    } else {
        (&OUTPUT_ONLY, "an input (it has no `from`)", "add `from` to make it an output")
    };
    keys.iter().filter(|k| point.values.has(k)).map(move |key| Problem {
        point: Some(point.name.clone()),
        key: (*key).into(),
        message: format!("`{}` is {is}, and `{key}` is for {}", point.name, if output { "inputs" } else { "outputs" }),
        help: Some(format!("take `{key}` away, or {other}")),
    })
}

fn build(config: DriverConfig) -> Result<Box<dyn Driver>, String> {
    Ok(Box::new(session(&config)?))
}

fn build_direct(config: DriverConfig, roles: Vec<Role>) -> Result<Box<dyn Direct>, String> {
    Ok(Box::new(Lane::new(&config, &roles)?))
}
