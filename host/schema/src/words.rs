//! Values and kinds in the words of messages and of the reference.

use crate::{Constant, Kind};
use latchwork_image::format_duration;
use toml::de::DeValue;

/// A whole number, if it is one of 64 bits.
pub(crate) fn integer(value: &DeValue<'_>) -> Option<i64> {
    let i = value.as_integer()?;
    i64::from_str_radix(i.as_str(), i.radix()).ok()
}

/// A number as the file has it, without separators.
pub(crate) fn number(value: &DeValue<'_>) -> String {
    match value {
        DeValue::Integer(i) => i.to_string(),
        DeValue::Float(f) => f.as_str().to_owned(),
        _ => String::new(),
    }
}

/// A constant, if the value is one.
pub fn constant(value: &DeValue<'_>) -> Option<Constant> {
    match value {
        DeValue::Boolean(b) => Some(Constant::Bool(*b)),
        DeValue::Integer(_) => integer(value).map(Constant::Integer),
        DeValue::Float(f) => f.as_str().parse().ok().map(Constant::Real),
        DeValue::String(s) => Some(Constant::Text(s.to_string())),
        _ => None,
    }
}

/// A value in the words of a message.
pub fn found(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(s) => format!("the string \"{s}\""),
        DeValue::Integer(_) if integer(value).is_none() => {
            format!("the whole number {}, which does not fit into 64 bits", number(value))
        }
        DeValue::Integer(_) => format!("the whole number {}", number(value)),
        DeValue::Float(_) => format!("the number {}", number(value)),
        DeValue::Boolean(b) => b.to_string(),
        DeValue::Datetime(_) => "a date".into(),
        DeValue::Array(_) => "a list".into(),
        DeValue::Table(_) => "a table".into(),
    }
}

/// What a kind holds, in the words of a message.
pub(crate) fn expected(kind: &Kind) -> String {
    match kind {
        Kind::Text => "a string".into(),
        Kind::Bool => "true or false".into(),
        Kind::Integer { min, max } => format!("a whole number {min} to {max}"),
        Kind::Duration { .. } => "a duration with its unit (h, m, s, ms, us, ns)".into(),
        Kind::Size { .. } => "a size with its unit (B, KiB, MiB, GiB)".into(),
        Kind::OneOf(words) => {
            format!("one of {}", words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(", "))
        }
        Kind::Tag => "the name of a tag".into(),
        Kind::Constant => "a constant".into(),
        Kind::List(of) => format!("a list, each item {}", expected(of)),
        Kind::Table(section) => format!("a table ({})", section.name),
        Kind::Map(of) => format!("a table of names, each {}", expected(of)),
        Kind::Either(one, other) => format!("{}, or {}", expected(one), expected(other)),
        Kind::Any => "any value".into(),
    }
}

/// What a user could write.
pub(crate) fn example(kind: &Kind) -> String {
    match kind {
        Kind::Text => "\"text\"".into(),
        Kind::Bool => "true".into(),
        Kind::Integer { min, .. } => min.to_string(),
        Kind::Duration { min, .. } => format!("\"{}\"", format_duration((*min).max(10_000_000))),
        Kind::Size { min, .. } => format!("\"{}\"", format_size((*min).max(1 << 20))),
        Kind::OneOf(words) => format!("\"{}\"", words.first().unwrap_or(&"")),
        Kind::Tag => "\"driver.point\"".into(),
        Kind::Constant => "0".into(),
        Kind::List(of) => format!("[{}]", example(of)),
        Kind::Table(section) => {
            let keys = section.keys.iter().filter(|k| k.required);
            format!(
                "{{ {} }}",
                keys.map(|k| format!("{} = {}", k.name, example(&k.kind))).collect::<Vec<_>>().join(", ")
            )
        }
        Kind::Map(of) => format!("{{ name = {} }}", example(of)),
        Kind::Either(one, _) => example(one),
        Kind::Any => "…".into(),
    }
}

/// `"4MiB"` in bytes.
pub fn parse_size(text: &str) -> Option<u64> {
    let text = text.trim();
    let digits = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let factor: u64 = match unit.trim() {
        "B" => 1,
        "KiB" => 1 << 10,
        "MiB" => 1 << 20,
        "GiB" => 1 << 30,
        _ => return None,
    };
    number.parse::<u64>().ok()?.checked_mul(factor)
}

/// Bytes with the largest unit that leaves a whole number.
pub fn format_size(bytes: u64) -> String {
    for (shift, unit) in [(30, "GiB"), (20, "MiB"), (10, "KiB")] {
        if bytes >= 1 << shift && bytes.is_multiple_of(1 << shift) {
            return format!("{}{unit}", bytes >> shift);
        }
    }
    format!("{bytes}B")
}
