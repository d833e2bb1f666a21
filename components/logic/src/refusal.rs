//! Why settings are refused: what was found and what was expected, in one sentence for the user.

use crate::number::Real;
use core::fmt;

/// Settings that cannot be worked with. Its text names the setting as the plant file does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refusal {
    name: &'static str,
    found: Number,
    expected: Expected,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Number {
    Real(f64),
    Integer(u64),
    Time(u64),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Expected {
    Text(&'static str),
    Related { how: &'static str, name: &'static str, value: Number },
}

impl Refusal {
    const fn new(name: &'static str, found: Number, expected: &'static str) -> Self {
        Self { name, found, expected: Expected::Text(expected) }
    }

    pub(crate) const fn related(
        (name, found): (&'static str, f64),
        how: &'static str,
        (other, value): (&'static str, f64),
    ) -> Self {
        let expected = Expected::Related { how, name: other, value: Number::Real(value) };
        Self { name, found: Number::Real(found), expected }
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Real(value) => Real(*value).fmt(f),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Time(ns) => write!(f, "{ns} ns"),
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} must be ", self.name, self.found)?;
        match self.expected {
            Expected::Text(text) => f.write_str(text),
            Expected::Related { how, name, value } => write!(f, "{how} {name} {value}"),
        }
    }
}

impl core::error::Error for Refusal {}

/// A finite number.
pub(crate) fn finite(name: &'static str, value: f64) -> Result<(), Refusal> {
    require(value.is_finite(), name, value, "a finite number")
}

/// A finite number above 0.
pub(crate) fn above_zero(name: &'static str, value: f64) -> Result<(), Refusal> {
    require(value.is_finite() && value > 0.0, name, value, "a finite number above 0")
}

/// A finite number, 0 or more.
pub(crate) fn not_negative(name: &'static str, value: f64) -> Result<(), Refusal> {
    require(value.is_finite() && value >= 0.0, name, value, "a finite number, 0 or more")
}

/// A time above 0.
pub(crate) fn some_time(name: &'static str, ns: u64) -> Result<(), Refusal> {
    if ns > 0 { Ok(()) } else { Err(Refusal::new(name, Number::Time(ns), "longer than 0, as in \"500ms\"")) }
}

/// A whole number that fulfils `holds`.
pub(crate) fn whole(holds: bool, name: &'static str, value: u64, expected: &'static str) -> Result<(), Refusal> {
    if holds { Ok(()) } else { Err(Refusal::new(name, Number::Integer(value), expected)) }
}

/// Two whole numbers in their order.
pub(crate) fn above(name: &'static str, value: u64, other: &'static str, low: u64) -> Result<(), Refusal> {
    let expected = Expected::Related { how: "above", name: other, value: Number::Integer(low) };
    if value > low { Ok(()) } else { Err(Refusal { name, found: Number::Integer(value), expected }) }
}

fn require(holds: bool, name: &'static str, value: f64, expected: &'static str) -> Result<(), Refusal> {
    if holds { Ok(()) } else { Err(Refusal::new(name, Number::Real(value), expected)) }
}
