//! Registers of a device ↔ cells of the process image.
//!
//! A register is 16 bits. Larger values take several of them; within a register the high byte comes first, as the
//! protocol has it, but the order of the registers is the maker's choice. Bits are handled as words 0 and 1.

use latchwork_image::{Type, Value};

/// How a value stands in its registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coding {
    /// True when the word is not 0; written as 1.
    Bool,
    /// One bit of a word.
    Bit(u8),
    U16,
    S16,
    U32,
    S32,
    F32,
    F64,
}

/// Order of the registers of one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Words {
    /// The most significant at the lowest address.
    Big,
    /// The least significant at the lowest address.
    Little,
}

impl Coding {
    /// Number of registers.
    pub(super) fn words(self) -> u16 {
        match self {
            Self::Bool | Self::Bit(_) | Self::U16 | Self::S16 => 1,
            Self::U32 | Self::S32 | Self::F32 => 2,
            Self::F64 => 4,
        }
    }

    /// Type of the tag.
    pub(super) fn ty(self) -> Type {
        match self {
            Self::Bool | Self::Bit(_) => Type::Bool,
            Self::U16 => Type::U16,
            Self::S16 => Type::S16,
            Self::U32 => Type::U32,
            Self::S32 => Type::S32,
            Self::F32 => Type::F32,
            Self::F64 => Type::F64,
        }
    }

    /// The cell that [`Self::words`] registers hold.
    pub(super) fn decode(self, registers: &[u16], order: Words) -> u64 {
        let join = |value: u64, word: &u16| value << 16 | u64::from(*word);
        let value = match order {
            Words::Big => registers.iter().fold(0, join),
            Words::Little => registers.iter().rev().fold(0, join),
        };
        match self {
            Self::Bool => u64::from(value != 0),
            Self::Bit(n) => value >> n & 1,
            // Sign-extended to 32 bits, as cells of s16 are.
            Self::S16 => u64::from(i32::from((value as u16).cast_signed()).cast_unsigned()),
            Self::U16 | Self::U32 | Self::S32 | Self::F32 | Self::F64 => value,
        }
    }

    /// Writes the registers for a cell into `into`, whose length is [`Self::words`].
    pub(super) fn encode(self, cell: u64, order: Words, into: &mut [u16]) {
        let value = if matches!(self, Self::Bool | Self::Bit(_)) { u64::from(cell != 0) } else { cell };
        let count = into.len();
        for (n, word) in into.iter_mut().enumerate() {
            let place = match order {
                Words::Big => count - 1 - n,
                Words::Little => n,
            };
            *word = (value >> (16 * place)) as u16;
        }
    }
}

/// An f64 for a number of this coding; NaN for what is none.
pub(super) fn widened(coding: Coding, cell: u64) -> u64 {
    let real = match coding.ty().value(cell) {
        Value::Integer(n) => n as f64,
        Value::Real(r) => r,
        _ => f64::NAN,
    };
    real.to_bits()
}

/// The number of this coding nearest to an f64: rounded, and kept within its range.
pub(super) fn narrowed(coding: Coding, cell: u64) -> u64 {
    let real = f64::from_bits(cell);
    let whole = real.round();
    // Conversions of `as` keep within the range, and take NaN for 0.
    match coding {
        Coding::U16 => u64::from(whole as u16),
        Coding::S16 => u64::from(i32::from(whole as i16).cast_unsigned()),
        Coding::U32 => u64::from(whole as u32),
        Coding::S32 => u64::from((whole as i32).cast_unsigned()),
        Coding::F32 => u64::from((real as f32).to_bits()),
        Coding::F64 | Coding::Bool | Coding::Bit(_) => cell,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What other implementations send for these values (pymodbus 3.16, and the examples of makers' manuals).
    #[test]
    fn known_values() {
        let cell = |ty: Type, text: &str| ty.parse(text).unwrap();
        for (coding, text, big) in [
            (Coding::U16, "65535", &[0xffff][..]),
            (Coding::S16, "-2", &[0xfffe]),
            (Coding::S16, "32767", &[0x7fff]),
            (Coding::U32, "305419896", &[0x1234, 0x5678]),
            (Coding::S32, "-2", &[0xffff, 0xfffe]),
            (Coding::F32, "1.5", &[0x3fc0, 0]),
            (Coding::F32, "-12.25", &[0xc144, 0]),
            (Coding::F64, "1.1", &[0x3ff1, 0x9999, 0x9999, 0x999a]),
            (Coding::Bool, "true", &[1]),
        ] {
            let little: Vec<u16> = big.iter().rev().copied().collect();
            let expected = cell(coding.ty(), text);
            let mut registers = vec![0; usize::from(coding.words())];
            for (order, words) in [(Words::Big, big), (Words::Little, &little)] {
                assert_eq!(coding.decode(words, order), expected, "{coding:?} {text} {order:?}");
                coding.encode(expected, order, &mut registers);
                assert_eq!(registers, words, "{coding:?} {text} {order:?}");
            }
        }
        assert_eq!(Coding::Bool.decode(&[0x8000], Words::Big), 1);
        assert_eq!(
            (Coding::Bit(15).decode(&[0x8000], Words::Big), Coding::Bit(14).decode(&[0x8000], Words::Big)),
            (1, 0)
        );
    }

    fn codings() -> impl Strategy<Value = Coding> {
        use Coding::*;
        prop::sample::select(vec![Bool, U16, S16, U32, S32, F32, F64])
    }

    #[test]
    fn a_register_as_a_real() {
        use Coding::*;
        for (coding, stored, real) in [
            (U16, "65535", 65535.0),
            (S16, "-2", -2.0),
            (U32, "4294967295", 4294967295.0),
            (S32, "-2147483648", -2147483648.0),
            (F32, "1.5", 1.5),
            (F64, "1.1", 1.1),
        ] {
            let cell = coding.ty().parse(stored).unwrap();
            assert_eq!(f64::from_bits(widened(coding, cell)), real, "{coding:?}");
            assert_eq!(narrowed(coding, f64::to_bits(real)), cell, "{coding:?}");
        }
        for (coding, real, stored) in [
            (U16, 65535.6, "65535"),
            (U16, -3.0, "0"),
            (U16, 2.5, "3"),
            (S16, -40000.0, "-32768"),
            (S16, f64::NAN, "0"),
            (U32, f64::INFINITY, "4294967295"),
            (S32, -1e300, "-2147483648"),
        ] {
            assert_eq!(narrowed(coding, real.to_bits()), coding.ty().parse(stored).unwrap(), "{coding:?} {real}");
        }
    }

    proptest! {
        /// Any registers give a cell that the type knows, and the same registers again.
        #[test]
        fn registers_survive_the_cell(coding in codings(), registers in any::<[u16; 4]>(), little: bool) {
            let order = if little { Words::Little } else { Words::Big };
            let registers = &registers[..usize::from(coding.words())];
            let cell = coding.decode(registers, order);
            let ty = coding.ty();
            let shown = ty.parse(&ty.format(cell)).unwrap();
            let nan = matches!(ty.value(cell), latchwork_image::Value::Real(r) if r.is_nan());
            prop_assert!(shown == cell || nan, "{cell:#x} is not a normal cell of {ty}");
            let mut back = vec![0; registers.len()];
            coding.encode(cell, order, &mut back);
            if coding == Coding::Bool {
                prop_assert_eq!(back, vec![u16::from(registers[0] != 0)]);
            } else {
                prop_assert_eq!(&back[..], registers);
            }
        }
    }
}
