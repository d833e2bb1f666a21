//! Types of tags and how their values stand in 64-bit cells.
//!
//! The bits of a cell are those of the canonical ABI's flat value, so the plain call path moves them without
//! conversion: unsigned and `bool` zero-extended, `s8`–`s32` sign-extended to 32 bits and then zero-extended, `f32` in
//! the low half, enum = index of the case, flags = bit mask, duration = nanoseconds.

use crate::{Value, format_duration, parse_duration};
use std::sync::Arc;

/// The type of one tag.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Type {
    /// `bool`
    Bool,
    /// `u8`
    U8,
    /// `u16`
    U16,
    /// `u32`
    U32,
    /// `u64`
    U64,
    /// `s8`
    S8,
    /// `s16`
    S16,
    /// `s32`
    S32,
    /// `s64`
    S64,
    /// `f32`
    F32,
    /// `f64`
    F64,
    /// `latchwork:block/types.duration`, nanoseconds of plant time.
    Duration,
    /// An enum with its cases in order.
    Enum(Arc<[String]>),
    /// Flags with their names in order, at most 32.
    Flags(Arc<[String]>),
}

/// A text or constant that is no value of the type.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{found} is not a {ty}; expected {expected}")]
pub struct ParseValueError {
    /// What was found.
    pub found: String,
    /// The type's name.
    pub ty: String,
    /// What would fit.
    pub expected: String,
}

impl Type {
    /// Those that need no names.
    pub const PLAIN: [Self; 12] = [
        Self::Bool,
        Self::U8,
        Self::U16,
        Self::U32,
        Self::U64,
        Self::S8,
        Self::S16,
        Self::S32,
        Self::S64,
        Self::F32,
        Self::F64,
        Self::Duration,
    ];

    /// The cell of a whole number, or `None` when the type cannot hold it. A real type takes whole numbers too.
    pub fn cell_from_integer(&self, i: i128) -> Option<u64> {
        Some(match self {
            Self::Bool => u64::from(match i {
                0 => false,
                1 => true,
                _ => return None,
            }),
            Self::U8 => u8::try_from(i).ok()?.into(),
            Self::U16 => u16::try_from(i).ok()?.into(),
            Self::U32 => u32::try_from(i).ok()?.into(),
            Self::U64 | Self::Duration => u64::try_from(i).ok()?,
            Self::S8 => signed(i8::try_from(i).ok()?.into()),
            Self::S16 => signed(i16::try_from(i).ok()?.into()),
            Self::S32 => signed(i32::try_from(i).ok()?),
            Self::S64 => i64::try_from(i).ok()?.cast_unsigned(),
            Self::F32 => u64::from((i as f32).to_bits()),
            Self::F64 => (i as f64).to_bits(),
            Self::Enum(cases) => u64::try_from(i).ok().filter(|i| (*i as usize) < cases.len())?,
            Self::Flags(names) => u64::try_from(i).ok().filter(|i| *i <= mask(names.len()))?,
        })
    }

    /// The cell of a real number; only `f32` and `f64` take one.
    pub fn cell_from_real(&self, r: f64) -> Option<u64> {
        match self {
            Self::F32 => Some(u64::from((r as f32).to_bits())),
            Self::F64 => Some(r.to_bits()),
            _ => None,
        }
    }

    /// Reads a value as a user writes it: `true`, `12`, `-1.5`, `nan`, `200ms`, an enum case, flags as `a|b`.
    pub fn parse(&self, text: &str) -> Result<u64, ParseValueError> {
        let text = text.trim();
        let found = match self {
            Self::Bool => match text {
                "true" | "1" => Some(1),
                "false" | "0" => Some(0),
                _ => None,
            },
            Self::Duration => parse_duration(text).ok(),
            Self::Enum(cases) => cases.iter().position(|c| c == text).map(|i| i as u64),
            Self::Flags(names) => text
                .split('|')
                .map(str::trim)
                .filter(|n| !n.is_empty())
                .try_fold(0, |bits, n| names.iter().position(|x| x == n).map(|i| bits | 1 << i)),
            // A number too large for its type is no infinity that anybody meant.
            Self::F32 | Self::F64 => text
                .parse()
                .ok()
                .filter(|r: &f64| r.is_finite() || !text.contains(|c: char| c.is_ascii_digit()))
                .and_then(|r| self.cell_from_real(r)),
            _ => text.parse().ok().and_then(|i| self.cell_from_integer(i)),
        };
        found.ok_or_else(|| self.refuse(format!("\"{text}\"")))
    }

    /// The error that says what would fit.
    pub fn refuse(&self, found: impl Into<String>) -> ParseValueError {
        ParseValueError { found: found.into(), ty: self.to_string(), expected: self.expected() }
    }

    fn expected(&self) -> String {
        match self {
            Self::Bool => "true or false".into(),
            Self::U8 => "a whole number 0 to 255".into(),
            Self::U16 => "a whole number 0 to 65535".into(),
            Self::U32 => "a whole number 0 to 4294967295".into(),
            Self::U64 => "a whole number 0 to 18446744073709551615".into(),
            Self::S8 => "a whole number -128 to 127".into(),
            Self::S16 => "a whole number -32768 to 32767".into(),
            Self::S32 => "a whole number -2147483648 to 2147483647".into(),
            Self::S64 => "a whole number -9223372036854775808 to 9223372036854775807".into(),
            Self::F32 | Self::F64 => "a number".into(),
            Self::Duration => "a duration such as \"200ms\" (units h, m, s, ms, us, ns)".into(),
            Self::Enum(cases) => format!("one of {}", list(cases)),
            Self::Flags(names) => format!("flags joined by \"|\" from {}", list(names)),
        }
    }

    /// The value a cell holds.
    pub fn value(&self, cell: u64) -> Value {
        match self {
            Self::Bool => Value::Boolean(cell != 0),
            Self::U8 | Self::U16 | Self::U32 | Self::U64 => Value::Integer(cell.into()),
            Self::S8 | Self::S16 | Self::S32 => Value::Integer((cell as u32).cast_signed().into()),
            Self::S64 => Value::Integer(cell.cast_signed().into()),
            Self::F32 => Value::Real(shortest(f32::from_bits(cell as u32))),
            Self::F64 => Value::Real(f64::from_bits(cell)),
            Self::Duration => Value::Text(format_duration(cell)),
            Self::Enum(cases) => match cases.get(cell as usize) {
                Some(case) => Value::Text(case.clone()),
                None => Value::Text(format!("?{cell}")),
            },
            Self::Flags(names) => Value::Text(
                names
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| cell >> i & 1 == 1)
                    .map(|(_, n)| n.as_str())
                    .collect::<Vec<_>>()
                    .join("|"),
            ),
        }
    }

    /// The value as text, the form that `parse` reads.
    pub fn format(&self, cell: u64) -> String {
        self.value(cell).to_string()
    }

    /// True when a cell is one that this type has: what comes from a file may be none.
    pub fn holds(&self, cell: u64) -> bool {
        match self {
            Self::Bool => cell <= 1,
            Self::U8 => cell <= u8::MAX.into(),
            Self::U16 => cell <= u16::MAX.into(),
            Self::U32 | Self::F32 => cell <= u32::MAX.into(),
            Self::S8 | Self::S16 | Self::S32 => {
                u32::try_from(cell).is_ok_and(|bits| self.cell_from_integer(bits.cast_signed().into()) == Some(cell))
            }
            Self::U64 | Self::S64 | Self::F64 | Self::Duration => true,
            Self::Enum(cases) => cell < cases.len() as u64,
            Self::Flags(names) => cell <= mask(names.len()),
        }
    }

    /// A short class of the type for tables: `bool`, `enum`, `flags`, …
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::U8 => "u8",
            Self::U16 => "u16",
            Self::U32 => "u32",
            Self::U64 => "u64",
            Self::S8 => "s8",
            Self::S16 => "s16",
            Self::S32 => "s32",
            Self::S64 => "s64",
            Self::F32 => "f32",
            Self::F64 => "f64",
            Self::Duration => "duration",
            Self::Enum(_) => "enum",
            Self::Flags(_) => "flags",
        }
    }
}

impl std::fmt::Display for Type {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Enum(cases) => write!(f, "enum {{ {} }}", cases.join(", ")),
            Self::Flags(names) => write!(f, "flags {{ {} }}", names.join(", ")),
            other => f.pad(other.kind()),
        }
    }
}

/// Sign-extended to 32 bits, zero-extended to 64.
fn signed(i: i32) -> u64 {
    u64::from(i.cast_unsigned())
}

fn mask(flags: usize) -> u64 {
    (1u64 << flags.min(63)) - 1
}

/// An `f32` as the `f64` with the same shortest text, so that 0.1 reads as 0.1 and not 0.10000000149011612.
fn shortest(r: f32) -> f64 {
    if r.is_finite() { r.to_string().parse().unwrap_or(f64::from(r)) } else { f64::from(r) }
}

fn list(names: &[String]) -> String {
    names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn names(n: &[&str]) -> Arc<[String]> {
        n.iter().map(|s| s.to_string()).collect()
    }

    fn all() -> Vec<Type> {
        let named = [Type::Enum(names(&["off", "on", "auto"])), Type::Flags(names(&["a", "b", "c"]))];
        Type::PLAIN.into_iter().chain(named).collect()
    }

    #[test]
    fn cells_are_the_canonical_flat_values() {
        assert_eq!(Type::S8.parse("-1").unwrap(), 0xffff_ffff);
        assert_eq!(Type::S64.parse("-1").unwrap(), u64::MAX);
        assert_eq!(Type::F32.parse("1").unwrap(), 0x3f80_0000);
        assert_eq!(Type::Flags(names(&["a", "b", "c"])).parse("a | c").unwrap(), 5);
        assert_eq!(Type::Duration.parse("2ms").unwrap(), 2_000_000);
    }

    #[test]
    fn refusals_say_what_fits() {
        let e = Type::U8.parse("300").unwrap_err().to_string();
        assert_eq!(e, "\"300\" is not a u8; expected a whole number 0 to 255");
        let e = Type::Enum(names(&["off", "on"])).parse("auto").unwrap_err().to_string();
        assert_eq!(e, "\"auto\" is not a enum { off, on }; expected one of \"off\", \"on\"");
    }

    #[test]
    fn a_type_knows_its_cells() {
        for (ty, highest) in
            [(Type::Bool, 1), (Type::U8, 255), (Type::F32, 0xffff_ffff), (Type::Flags(names(&["a", "b"])), 3)]
        {
            assert!(ty.holds(highest) && !ty.holds(highest + 1), "{ty}");
        }
        assert!(Type::S8.holds(signed(-128)) && !Type::S8.holds(signed(-129)) && !Type::S8.holds(u64::MAX));
        assert!(Type::Enum(names(&["a", "b"])).holds(1) && !Type::Enum(names(&["a", "b"])).holds(2));
    }

    proptest! {
        #[test]
        fn what_is_shown_reads_back(bits: u64) {
            for ty in all() {
                // Bring random bits into the type's range first: cells are always normalised.
                let cell = match &ty {
                    Type::Bool => bits & 1,
                    Type::U8 => bits & 0xff,
                    Type::U16 => bits & 0xffff,
                    Type::U32 | Type::F32 | Type::S32 => bits & 0xffff_ffff,
                    Type::S8 => signed((bits as i8).into()),
                    Type::S16 => signed((bits as i16).into()),
                    Type::Enum(n) => bits % n.len() as u64,
                    Type::Flags(n) => bits & mask(n.len()),
                    _ => bits,
                };
                prop_assert!(ty.holds(cell), "{ty}: {cell:#x}");
                let nan = matches!(ty.value(cell), Value::Real(r) if r.is_nan());
                let back = ty.parse(&ty.format(cell)).unwrap();
                prop_assert!(back == cell || nan, "{ty}: {cell:#x} → {} → {back:#x}", ty.format(cell));
            }
        }
    }
}
