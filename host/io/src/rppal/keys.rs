//! The kind and its keys.

use super::driver::session;
use super::place::{HIGHEST_PIN, check, point};
use super::points::Points;
use crate::direct::{Direct, Role};
use crate::driver::{Driver, DriverConfig, DriverKind};
use latchwork_image::parse_duration;
use latchwork_schema::{Key, Kind, Section, Values};
use std::time::Duration;

const US: u64 = 1_000;
const MS: u64 = 1_000 * US;
const SECOND: u64 = 1_000 * MS;

/// Lowest and highest frequency of a PWM point, Hz.
pub(super) const FREQUENCY: std::ops::RangeInclusive<f64> = 1.0..=10_000_000.0;
/// Frequency of a PWM point that names none, Hz.
pub(super) const DEFAULT_FREQUENCY: f64 = 1000.0;

/// Raspberry Pi.
pub(crate) static RPPAL: DriverKind =
    DriverKind { name: "rppal", keys: &DRIVER, point_keys: &POINT, point, check, build, direct: Some(direct) };

static DRIVER: Section = Section {
    name: "driver (rppal)",
    doc: "The pins of a Raspberry Pi through memory-mapped registers. On other boards use kind = \"gpio\".",
    keys: &[
        EVERY,
        Key::optional(
            "pwm-chip",
            Kind::Integer { min: 0, max: 255 },
            "",
            "Number of the PWM chip in /sys/class/pwm. Without it the one that the model usually has.",
        ),
    ],
};

const EVERY: Key = Key::optional(
    "every",
    Kind::Duration { min: 100 * US, max: 3_600 * SECOND },
    "\"5ms\"",
    "Period of the cycle: read every input, then write every output that has changed. Points of an interrupt lane do not \
     wait for it.",
);

static POINT: Section = Section {
    name: "point (rppal)",
    doc: "One pin (`pin`, a bool) or one PWM channel (`pwm`, an f64 from 0.0 to 1.0, with `from`).",
    keys: &[
        Key::optional(
            "pin",
            Kind::Integer { min: 0, max: HIGHEST_PIN as i64 },
            "",
            "Number of the pin as the chip's maker counts (BCM, GPIO17 is 17), not its place on the header. 28 to 45 are \
             there on Compute Modules only.",
        ),
        Key::optional(
            "bias",
            Kind::OneOf(&["as-is", "pull-up", "pull-down", "disabled"]),
            "\"as-is\"",
            "The pull resistor of an input.",
        ),
        Key::optional(
            "active-low",
            Kind::Bool,
            "false",
            "The point is true when the pin is low. The values of outputs, `safe` and the names of edges follow.",
        ),
        Key::optional(
            "edge",
            Kind::OneOf(&["both", "rising", "falling"]),
            "\"both\"",
            "Which edges start the interrupt lane that has this point in its `on`: those of the point's value.",
        ),
        Key::optional(
            "debounce",
            Kind::Duration { min: US, max: 10 * SECOND },
            "",
            "A change of an input counts once it has held this long. The kernel does this, to the microsecond; the edge \
             keeps the time it began to hold plus this.",
        ),
        Key::optional(
            "pwm",
            Kind::Integer { min: 0, max: 3 },
            "",
            "A hardware PWM channel in place of a pin: 0 is GPIO12 or 18, 1 is GPIO13 or 19 (Pi 5: 0 to 3 are GPIO12, 13, \
             18, 19). The channel must be switched on in /boot/firmware/config.txt.",
        ),
        Key::optional("frequency", Kind::Constant, "1000", "Frequency of the PWM, Hz, from 1 to 10000000."),
    ],
};

fn build(config: DriverConfig) -> Result<Box<dyn Driver>, String> {
    let every = config.values.duration(EVERY.name).or_else(|| parse_duration(EVERY.default.trim_matches('"')).ok());
    Ok(Box::new(session(&config, Duration::from_nanos(every.unwrap_or(5 * MS)))?))
}

fn direct(config: DriverConfig, roles: Vec<Role>) -> Result<Box<dyn Direct>, String> {
    Ok(Box::new(Points::new(&config, &roles)?))
}

/// Number of the PWM chip, when the user knows better.
pub(super) fn pwm_chip(values: &Values) -> Option<u8> {
    values.integer("pwm-chip").and_then(|n| u8::try_from(n).ok())
}
