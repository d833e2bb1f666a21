//! What a point is, and what may be wrong with it.

use super::keys::{DEFAULT_FREQUENCY, FREQUENCY};
use crate::driver::{DriverConfig, PointConfig, PointShape, Problem};
use latchwork_image::Type;
use latchwork_schema::{Constant, Values};
use rppal::gpio::Bias;
use std::time::Duration;

/// Highest pin a user can reach, on a Compute Module. Those above belong to the board itself (SD card).
pub(super) const HIGHEST_PIN: u8 = 45;

/// Edges of a point's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edges {
    Both,
    Rising,
    Falling,
}

/// A pin and how it is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PinPlace {
    pub(super) pin: u8,
    /// `None`: as it is.
    pub(super) bias: Option<Bias>,
    pub(super) active_low: bool,
    pub(super) edges: Edges,
    pub(super) debounce: Option<Duration>,
}

/// A PWM channel and how it is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PwmPlace {
    pub(super) channel: u8,
    /// ns.
    pub(super) period: u64,
}

/// Where a point stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Pin(PinPlace),
    Pwm(PwmPlace),
}

impl Place {
    /// Reads the keys of a point. Every problem with them is told at once.
    pub(super) fn of(values: &Values) -> Result<Self, Vec<Problem>> {
        match (number(values, "pin"), number(values, "pwm")) {
            (None, None) => Err(vec![problem(
                "",
                "the point names no pin",
                "write its BCM number, as in { pin = 17 }, or a PWM channel, as in { pwm = 0 }",
            )]),
            (Some(_), Some(_)) => Err(vec![problem(
                "pwm",
                "the point names a pin and a PWM channel",
                "keep one: the board connects a channel with its pin itself, where config.txt says so",
            )]),
            (Some(pin), None) => pin_place(pin, values).map(Self::Pin),
            (None, Some(channel)) => pwm_place(channel, values).map(Self::Pwm),
        }
    }

    /// Key that names it.
    fn key(self) -> &'static str {
        match self {
            Self::Pin(_) => "pin",
            Self::Pwm(_) => "pwm",
        }
    }

    /// Two places of one name share a wire.
    pub(super) fn name(self) -> String {
        match self {
            Self::Pin(p) => format!("GPIO{}", p.pin),
            Self::Pwm(p) => format!("PWM channel {}", p.channel),
        }
    }
}

fn number(values: &Values, key: &str) -> Option<u8> {
    values.integer(key).map(|n| u8::try_from(n).unwrap_or(u8::MAX))
}

fn problem(key: &str, message: &str, help: &str) -> Problem {
    Problem { point: None, key: key.into(), message: message.into(), help: Some(help.into()) }
}

fn pin_place(pin: u8, values: &Values) -> Result<PinPlace, Vec<Problem>> {
    if values.has("frequency") {
        let message = "`frequency` is of a PWM channel, and the point is a pin";
        return Err(vec![problem("frequency", message, "take `frequency` away, or name `pwm` in place of `pin`")]);
    }
    Ok(PinPlace {
        pin,
        bias: match values.text("bias") {
            Some("pull-up") => Some(Bias::PullUp),
            Some("pull-down") => Some(Bias::PullDown),
            Some("disabled") => Some(Bias::Off),
            _ => None,
        },
        active_low: values.bool("active-low").unwrap_or(false),
        edges: match values.text("edge") {
            Some("rising") => Edges::Rising,
            Some("falling") => Edges::Falling,
            _ => Edges::Both,
        },
        debounce: values.duration("debounce").map(Duration::from_nanos),
    })
}

fn pwm_place(channel: u8, values: &Values) -> Result<PwmPlace, Vec<Problem>> {
    let mut problems = Vec::new();
    for key in ["bias", "active-low", "edge", "debounce"] {
        if values.has(key) {
            let message = format!("`{key}` is of a pin, and the point is a PWM channel");
            problems.push(problem(key, &message, &format!("take `{key}` away, or name `pin` in place of `pwm`")));
        }
    }
    let frequency = match values.constant("frequency") {
        None => Ok(DEFAULT_FREQUENCY),
        Some(Constant::Integer(i)) => Ok(*i as f64),
        Some(Constant::Real(r)) => Ok(*r),
        Some(Constant::Bool(b)) => Err(b.to_string()),
        Some(Constant::Text(t)) => Err(format!("\"{t}\"")),
    };
    match frequency.and_then(|f| if FREQUENCY.contains(&f) { Ok(f) } else { Err(f.to_string()) }) {
        Ok(f) if problems.is_empty() => return Ok(PwmPlace { channel, period: (1e9 / f).round() as u64 }),
        Ok(_) => {}
        Err(found) => problems.push(problem(
            "frequency",
            &format!("{found} is no frequency of a PWM channel"),
            "write a number of hertz from 1 to 10000000, as in frequency = 1000",
        )),
    }
    Err(problems)
}

/// Shape of a point for the plant.
pub(super) fn point(values: &Values) -> Result<PointShape, Vec<Problem>> {
    Ok(match Place::of(values)? {
        Place::Pin(_) => PointShape { ty: Type::Bool, writable: true, readable: true },
        Place::Pwm(_) => PointShape { ty: Type::F64, writable: true, readable: false },
    })
}

/// What is wrong with the points taken together.
pub(super) fn check(config: &DriverConfig) -> Vec<Problem> {
    let places: Vec<(&PointConfig, Place)> =
        config.points.iter().filter_map(|p| Place::of(&p.values).ok().map(|place| (p, place))).collect();
    let mut problems = Vec::new();
    for (n, (point, place)) in places.iter().enumerate() {
        problems.extend(wrong(point, *place));
        if let Some((other, _)) = places[..n].iter().find(|(_, p)| p.name() == place.name()) {
            problems.push(Problem {
                point: Some(point.name.clone()),
                key: place.key().into(),
                message: format!("`{}` is at {} too", other.name, place.name()),
                help: Some(format!("choose another for `{}`, or use `{}` in its place", point.name, other.name)),
            });
        }
    }
    problems
}

fn wrong(point: &PointConfig, place: Place) -> Vec<Problem> {
    let of = |key: &str, message: String, help: String| Problem {
        point: Some(point.name.clone()),
        key: key.into(),
        message,
        help: Some(help),
    };
    match (place, point.safe) {
        (Place::Pin(_), Some(_)) => {
            let keys = ["bias", "edge", "debounce"].into_iter().filter(|k| point.values.has(k));
            let tell = |k| {
                let message = format!("`{}` is an output, and `{k}` is of an input", point.name);
                of(k, message, format!("take `{k}` away, or take `from` away to read the pin"))
            };
            keys.map(tell).collect()
        }
        (Place::Pwm(_), Some(safe)) if !(0.0..=1.0).contains(&f64::from_bits(safe)) => {
            let message = format!("the safe value {} is no duty cycle", f64::from_bits(safe));
            vec![of("safe", message, "write a number from 0.0 (always low) to 1.0 (always high)".into())]
        }
        (Place::Pwm(_), None) => {
            let message = format!("`{}` is a PWM channel, which can only be written", point.name);
            vec![of("pwm", message, "name the tag it shows, as in from = \"control.outputs.speed\"".into())]
        }
        _ => Vec::new(),
    }
}
