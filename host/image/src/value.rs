//! A value outside the scan path: for records, files and displays.

use serde::Serialize;

/// A value of a tag with its meaning, as records and JSON carry it (`latchwork:journal/types.value`).
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Value {
    /// No value.
    #[default]
    None,
    /// A boolean.
    Boolean(bool),
    /// A whole number; `u64` above `i64::MAX` is carried too.
    Integer(i128),
    /// A real number.
    Real(f64),
    /// An enum case, a set of flags, a duration, a text.
    Text(String),
}

impl Serialize for Value {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::None => serializer.serialize_none(),
            Self::Boolean(b) => serializer.serialize_bool(*b),
            Self::Integer(i) => match (i64::try_from(*i), u64::try_from(*i)) {
                (Ok(i), _) => serializer.serialize_i64(i),
                (_, Ok(u)) => serializer.serialize_u64(u),
                _ => serializer.collect_str(i),
            },
            // JSON has no NaN and no infinities: they are carried as text rather than lost.
            Self::Real(r) if !r.is_finite() => serializer.collect_str(&format_args!("{r:?}")),
            Self::Real(r) => serializer.serialize_f64(*r),
            Self::Text(t) => serializer.serialize_str(t),
        }
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::None => f.pad("-"),
            Self::Boolean(b) => std::fmt::Display::fmt(b, f),
            Self::Integer(i) => std::fmt::Display::fmt(i, f),
            Self::Real(r) => f.pad(&format!("{r:?}")),
            Self::Text(t) => f.pad(t),
        }
    }
}
