//! Values as a test gives and compares them.

use latchwork_image::{ParseValueError, Quality, Type, Value};

/// A value as a test gives it: a bool, a number, or a text for durations (`"2s"`), enums and flags (`"a|b"`).
#[derive(Clone, Debug, PartialEq)]
pub struct Given(pub(super) Value);

/// A value that came out, with its quality; of a plain port it is good. Compares with bools, numbers and texts.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Value.
    pub value: Value,
    /// Quality.
    pub quality: Quality,
}

/// The cell of a given value.
pub(super) fn cell(ty: &Type, given: &Given) -> Result<u64, ParseValueError> {
    let made = match (&given.0, ty) {
        (Value::Boolean(b), Type::Bool) => Some(u64::from(*b)),
        (Value::Integer(_), Type::Bool | Type::Enum(_) | Type::Flags(_) | Type::Duration) => None,
        (Value::Integer(i), _) => ty.cell_from_integer(*i),
        (Value::Real(r), _) => ty.cell_from_real(*r),
        (Value::Text(text), Type::Duration | Type::Enum(_) | Type::Flags(_)) => return ty.parse(text),
        _ => None,
    };
    made.ok_or_else(|| ty.refuse(given.0.to_string()))
}

impl From<bool> for Given {
    fn from(b: bool) -> Self {
        Self(Value::Boolean(b))
    }
}

impl From<f64> for Given {
    fn from(r: f64) -> Self {
        Self(Value::Real(r))
    }
}

impl From<&str> for Given {
    fn from(text: &str) -> Self {
        Self(Value::Text(text.into()))
    }
}

impl From<i32> for Given {
    fn from(i: i32) -> Self {
        Self(Value::Integer(i.into()))
    }
}

impl From<i64> for Given {
    fn from(i: i64) -> Self {
        Self(Value::Integer(i.into()))
    }
}

impl From<u64> for Given {
    fn from(i: u64) -> Self {
        Self(Value::Integer(i.into()))
    }
}

impl<T: Clone + Into<Given>> PartialEq<T> for Output {
    fn eq(&self, other: &T) -> bool {
        match (&self.value, other.clone().into().0) {
            // A whole number is also how a real is written.
            (Value::Real(r), Value::Integer(i)) => *r == i as f64,
            (value, other) => *value == other,
        }
    }
}

impl std::fmt::Display for Output {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.quality {
            Quality::Good => write!(f, "{}", self.value),
            quality => write!(f, "{} {quality}", self.value),
        }
    }
}
