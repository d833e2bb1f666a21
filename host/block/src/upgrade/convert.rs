//! One value of one type as a value of another.
//!
//! A kind never changes: a bool, an enum or flags are no numbers, whatever their bits. Such a field counts as a new one.

use latchwork_image::Type;

/// How the cell of one type becomes that of another.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Convert {
    /// The same bits mean the same.
    Copy,
    /// A number in another type: a real is cut to a whole number, what does not fit is the nearest that does, NaN is 0.
    Number(Number, Number),
    /// By case: the new index, or none for a case that is gone.
    Cases(Box<[Option<u32>]>),
    /// By flag: the bit before and after, of those that are still there.
    Bits(Box<[(u8, u8)]>),
}

/// Types of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    /// Bits of an integer without sign.
    Unsigned(u32),
    /// Bits of an integer with sign.
    Signed(u32),
    F32,
    F64,
}

/// What a conversion does to values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Loss {
    /// The types are equal.
    Same,
    /// The types differ, and every value survives.
    Nothing,
    /// There are values that do not survive.
    Some,
}

impl Convert {
    /// The conversion and what it does to values; `None` when the types are of different kinds.
    pub(super) fn new(old: &Type, new: &Type) -> Option<(Self, Loss)> {
        if old == new {
            return Some((Self::Copy, Loss::Same));
        }
        let loss = |lossless| if lossless { Loss::Nothing } else { Loss::Some };
        match (old, new) {
            (Type::Duration, Type::U64) | (Type::U64, Type::Duration) => Some((Self::Copy, Loss::Nothing)),
            (Type::Enum(old), Type::Enum(new)) => {
                let cases: Box<[_]> = old.iter().map(|c| position(new, c)).collect();
                let lossless = cases.iter().all(Option::is_some);
                Some((Self::Cases(cases), loss(lossless)))
            }
            (Type::Flags(old), Type::Flags(new)) => {
                let bits: Box<[_]> = (0u8..)
                    .zip(old.iter())
                    .filter_map(|(from, name)| Some((from, u8::try_from(position(new, name)?).ok()?)))
                    .collect();
                let lossless = bits.len() == old.len();
                Some((Self::Bits(bits), loss(lossless)))
            }
            (old, new) => {
                let (old, new) = (Number::of(old)?, Number::of(new)?);
                Some((Self::Number(old, new), loss(new.holds(old))))
            }
        }
    }

    /// The new cell; `None` where nothing of the value is left: an enum's case that is gone.
    #[inline]
    pub(super) fn apply(&self, cell: u64) -> Option<u64> {
        match self {
            Self::Copy => Some(cell),
            Self::Number(from, to) => Some(to.convert(*from, cell)),
            Self::Cases(cases) => cases.get(usize::try_from(cell).ok()?).copied().flatten().map(u64::from),
            Self::Bits(bits) => Some(bits.iter().fold(0, |word, (from, to)| word | (cell >> from & 1) << to)),
        }
    }
}

fn position(names: &[String], name: &str) -> Option<u32> {
    names.iter().position(|n| n == name).and_then(|at| u32::try_from(at).ok())
}

impl Number {
    fn of(ty: &Type) -> Option<Self> {
        Some(match ty {
            Type::U8 => Self::Unsigned(8),
            Type::U16 => Self::Unsigned(16),
            Type::U32 => Self::Unsigned(32),
            Type::U64 => Self::Unsigned(64),
            Type::S8 => Self::Signed(8),
            Type::S16 => Self::Signed(16),
            Type::S32 => Self::Signed(32),
            Type::S64 => Self::Signed(64),
            Type::F32 => Self::F32,
            Type::F64 => Self::F64,
            Type::Bool | Type::Duration | Type::Enum(_) | Type::Flags(_) => return None,
        })
    }

    /// Least and greatest value of an integer; for a real, of the whole numbers of which it holds every one.
    fn whole(self) -> (i128, i128) {
        match self {
            Self::Unsigned(bits) => (0, (1 << bits) - 1),
            Self::Signed(bits) => (-(1 << (bits - 1)), (1 << (bits - 1)) - 1),
            Self::F32 => (-(1 << f32::MANTISSA_DIGITS), 1 << f32::MANTISSA_DIGITS),
            Self::F64 => (-(1 << f64::MANTISSA_DIGITS), 1 << f64::MANTISSA_DIGITS),
        }
    }

    fn is_real(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// Every value of `other` is one of this type.
    fn holds(self, other: Self) -> bool {
        let ((least, greatest), (its_least, its_greatest)) = (self.whole(), other.whole());
        (self.is_real() || !other.is_real()) && least <= its_least && its_greatest <= greatest
    }

    /// The cell of this type for a cell of another.
    fn convert(self, from: Self, cell: u64) -> u64 {
        match from {
            Self::Unsigned(_) => self.whole_number(cell.into()),
            Self::Signed(64) => self.whole_number(cell.cast_signed().into()),
            // Narrower ones are sign-extended to 32 bits.
            Self::Signed(_) => self.whole_number((cell as u32).cast_signed().into()),
            Self::F32 => self.real(f64::from(f32::from_bits(cell as u32))),
            Self::F64 => self.real(f64::from_bits(cell)),
        }
    }

    fn whole_number(self, value: i128) -> u64 {
        let (least, greatest) = self.whole();
        match self {
            Self::Unsigned(_) | Self::Signed(64) => value.clamp(least, greatest) as u64,
            Self::Signed(_) => u64::from(value.clamp(least, greatest) as u32),
            // The nearest there is.
            Self::F32 => u64::from((value as f32).to_bits()),
            Self::F64 => (value as f64).to_bits(),
        }
    }

    fn real(self, value: f64) -> u64 {
        match self {
            Self::F64 => value.to_bits(),
            Self::F32 => {
                let narrow = value as f32;
                let overflown = narrow.is_infinite() && value.is_finite();
                u64::from(if overflown { f32::MAX.copysign(narrow) } else { narrow }.to_bits())
            }
            // The conversion cuts, saturates, and takes NaN as 0.
            Self::Unsigned(_) | Self::Signed(_) => self.whole_number(value as i128),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(n: &[&str]) -> std::sync::Arc<[String]> {
        n.iter().map(|s| s.to_string()).collect()
    }

    /// Row by row what fits into what.
    #[test]
    fn a_wider_type_loses_nothing() {
        use Type::{F32, F64, S8, S16, S32, S64, U8, U16, U32, U64};
        let all = [U8, U16, U32, U64, S8, S16, S32, S64, F32, F64];
        for (old, lossless) in [
            (U8, vec![U16, U32, U64, S16, S32, S64, F32, F64]),
            (U16, vec![U32, U64, S32, S64, F32, F64]),
            (U32, vec![U64, S64, F64]),
            (U64, vec![]),
            (S8, vec![S16, S32, S64, F32, F64]),
            (S16, vec![S32, S64, F32, F64]),
            (S32, vec![S64, F64]),
            (S64, vec![]),
            (F32, vec![F64]),
            (F64, vec![]),
        ] {
            for new in &all {
                let expected = match new {
                    same if *same == old => Loss::Same,
                    wider if lossless.contains(wider) => Loss::Nothing,
                    _ => Loss::Some,
                };
                assert_eq!(Convert::new(&old, new).expect("two numbers").1, expected, "{old} → {new}");
            }
        }
    }

    #[test]
    fn kinds_do_not_change_but_a_duration_is_its_nanoseconds() {
        let kinds = [Type::Bool, Type::U8, Type::Duration, Type::Enum(names(&["a"])), Type::Flags(names(&["a"]))];
        for (i, old) in kinds.iter().enumerate() {
            for (j, new) in kinds.iter().enumerate() {
                assert_eq!(Convert::new(old, new).is_some(), i == j, "{old} → {new}");
            }
        }
        for (old, new) in [(Type::U64, Type::Duration), (Type::Duration, Type::U64)] {
            assert_eq!(Convert::new(&old, &new), Some((Convert::Copy, Loss::Nothing)));
        }
    }

    /// Old type, its value, new type, the value there; as a user reads them.
    #[test]
    fn what_does_not_fit_is_the_nearest_that_does() {
        for (old, value, new, expected) in [
            (Type::U16, "300", Type::U8, "255"),
            (Type::S16, "-300", Type::U8, "0"),
            (Type::S16, "-300", Type::S8, "-128"),
            (Type::S8, "-1", Type::S64, "-1"),
            (Type::S64, "-1", Type::S8, "-1"),
            (Type::S64, "-9223372036854775808", Type::U64, "0"),
            (Type::U64, "18446744073709551615", Type::S64, "9223372036854775807"),
            (Type::U64, "18446744073709551615", Type::S32, "2147483647"),
            (Type::S8, "-5", Type::F32, "-5"),
            (Type::U64, "9007199254740993", Type::F64, "9007199254740992"),
            (Type::F64, "2.9", Type::U8, "2"),
            (Type::F64, "-2.9", Type::S8, "-2"),
            (Type::F64, "-2.9", Type::U8, "0"),
            (Type::F64, "inf", Type::U16, "65535"),
            (Type::F64, "-inf", Type::S64, "-9223372036854775808"),
            (Type::F32, "nan", Type::S16, "0"),
            (Type::F64, "1e300", Type::F32, "340282350000000000000000000000000000000"),
            (Type::F64, "-1e300", Type::F32, "-340282350000000000000000000000000000000"),
            (Type::F64, "-inf", Type::F32, "-inf"),
            (Type::F64, "nan", Type::F32, "nan"),
            (Type::F32, "0.5", Type::F64, "0.5"),
        ] {
            let cell = old.parse(value).expect("a value");
            let (convert, _) = Convert::new(&old, &new).expect("two numbers");
            let cell = convert.apply(cell).expect("a number stays one");
            // Both as they are shown: an expected one that is written in another way is the same.
            assert_eq!(new.format(cell), new.format(new.parse(expected).expect("a value")), "{old} {value} → {new}");
        }
    }

    #[test]
    fn enums_and_flags_go_by_name() {
        let (old, new) = (Type::Enum(names(&["off", "on", "auto"])), Type::Enum(names(&["auto", "off"])));
        let (convert, loss) = Convert::new(&old, &new).expect("two enums");
        assert_eq!(loss, Loss::Some);
        // The last is no case at all.
        assert_eq!([0, 1, 2, 3].map(|cell| convert.apply(cell)), [Some(1), None, Some(0), None]);
        assert_eq!(Convert::new(&new, &old).expect("two enums").1, Loss::Nothing);

        let (old, new) = (Type::Flags(names(&["a", "b", "c"])), Type::Flags(names(&["c", "x", "a"])));
        let (convert, loss) = Convert::new(&old, &new).expect("two sets of flags");
        assert_eq!(loss, Loss::Some);
        assert_eq!([0b001, 0b010, 0b100, 0b111].map(|cell| convert.apply(cell)), [4, 0, 1, 5].map(Some));
        let more = Type::Flags(names(&["c", "x", "a", "b"]));
        assert_eq!(Convert::new(&old, &more).expect("two sets of flags").1, Loss::Nothing);
    }
}
