//! Values by type: those that are used, and those that hurt.

use super::constants::Constants;
use fastrand::Rng;
use latchwork_image::{Quality, Type};

const MS: u64 = 1_000_000;
const SECOND: u64 = 1_000_000_000;
const HOUR: u64 = 3600 * SECOND;

/// NaN quiet, signalling and with a payload, infinities, zeros, the smallest, the largest.
const REALS: [u64; 16] = [
    0,
    1 << 63,
    0x7ff8_0000_0000_0000,
    0xfff8_0000_0000_0000,
    0x7ff0_0000_0000_0001,
    0x7ff8_dead_beef_cafe,
    0x7ff0_0000_0000_0000,
    0xfff0_0000_0000_0000,
    1,
    0x800f_ffff_ffff_ffff,
    0x0010_0000_0000_0000,
    0x7fef_ffff_ffff_ffff,
    0xffef_ffff_ffff_ffff,
    0x3ff0_0000_0000_0000,
    0xbff0_0000_0000_0000,
    0x4340_0000_0000_0000,
];
const SINGLES: [u32; 12] = [
    0,
    1 << 31,
    0x7fc0_0000,
    0xffc0_0000,
    0x7f80_0001,
    0x7fc0_beef,
    0x7f80_0000,
    0xff80_0000,
    1,
    0x7f7f_ffff,
    0xff7f_ffff,
    0x3f80_0000,
];

/// Numbers that were seen before: a threshold among the settings is worth meeting exactly.
#[derive(Debug, Default)]
pub(super) struct Seen {
    reals: Vec<f64>,
    integers: Vec<i64>,
    durations: Vec<u64>,
}

impl Seen {
    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.reals.clear();
        self.integers.clear();
        self.durations.clear();
    }

    /// Notes a value.
    pub(super) fn note(&mut self, ty: &Type, cell: u64) {
        match ty {
            Type::Duration => self.durations.push(cell),
            Type::F32 | Type::F64 => self.reals.push(real(ty, cell)),
            Type::Bool | Type::Enum(_) | Type::Flags(_) => {}
            _ => self.integers.push(integer(ty, cell)),
        }
    }
}

/// Any bits as a legal cell of a type.
pub(super) fn normal(ty: &Type, bits: u64) -> u64 {
    let signed = |i: i32| u64::from(i.cast_unsigned());
    match ty {
        Type::Bool => bits & 1,
        Type::U8 => bits & 0xff,
        Type::U16 => bits & 0xffff,
        Type::U32 | Type::S32 | Type::F32 => bits & 0xffff_ffff,
        Type::S8 => signed((bits as i8).into()),
        Type::S16 => signed((bits as i16).into()),
        Type::U64 | Type::S64 | Type::F64 | Type::Duration => bits,
        Type::Enum(cases) => bits % cases.len().max(1) as u64,
        Type::Flags(names) => bits & ((1 << names.len()) - 1),
    }
}

/// The number in a cell of a real type.
pub(super) fn real(ty: &Type, cell: u64) -> f64 {
    if *ty == Type::F32 { f32::from_bits(cell as u32).into() } else { f64::from_bits(cell) }
}

/// The cell of a number.
pub(super) fn real_cell(ty: &Type, r: f64) -> u64 {
    if *ty == Type::F32 { (r as f32).to_bits().into() } else { r.to_bits() }
}

/// The number in a cell of an integer type; of `u64` the upper half is negative.
fn integer(ty: &Type, cell: u64) -> i64 {
    match ty {
        Type::S8 | Type::S16 | Type::S32 => (cell as u32).cast_signed().into(),
        _ => cell.cast_signed(),
    }
}

/// A value of a type.
pub(super) fn value(rng: &mut Rng, ty: &Type, constants: &Constants, seen: &Seen) -> u64 {
    match ty {
        Type::Bool => u64::from(rng.bool()),
        Type::Enum(_) => normal(ty, rng.u64(..)),
        Type::Flags(names) => match rng.u8(..4) {
            0 => 0,
            1 => normal(ty, u64::MAX),
            2 => 1 << rng.usize(..names.len().max(1)),
            _ => normal(ty, rng.u64(..)),
        },
        Type::F32 | Type::F64 => a_real(rng, ty, constants, seen),
        Type::Duration => a_duration(rng, seen),
        _ => an_integer(rng, ty, constants, seen),
    }
}

/// A quality; most are good.
pub(super) fn quality(rng: &mut Rng) -> u64 {
    match rng.u8(..8) {
        0 => Quality::Uncertain.cell(),
        1 => Quality::Bad.cell(),
        _ => Quality::Good.cell(),
    }
}

fn a_real(rng: &mut Rng, ty: &Type, constants: &Constants, seen: &Seen) -> u64 {
    let near = |rng: &mut Rng, r: f64| match rng.u8(..6) {
        0 => r.next_up(),
        1 => r.next_down(),
        2 => r + 1.0,
        3 => r - 1.0,
        _ => r,
    };
    let r = match rng.u8(..16) {
        0 | 1 if *ty == Type::F32 => return rng.choice(SINGLES).unwrap_or(0).into(),
        0 | 1 => return rng.choice(REALS).unwrap_or(0),
        2..=4 => rng.i32(-10..=10).into(),
        5..=7 => f64::from(rng.i32(-10_000..=10_000)) / 100.0,
        8 => rng.i32(0..=65535).into(),
        9 => 10f64.powf(rng.f64() * 40.0 - 20.0) * if rng.bool() { 1.0 } else { -1.0 },
        10 => return normal(ty, rng.u64(..)),
        11 => rng.choice(&constants.integers).map_or(0.0, |i| *i as f64),
        12 | 13 => {
            let r = rng.choice(&constants.reals).copied().unwrap_or(0.0);
            near(rng, r)
        }
        _ => {
            let r = rng.choice(&seen.reals).copied().unwrap_or(0.0);
            near(rng, r)
        }
    };
    real_cell(ty, r)
}

fn an_integer(rng: &mut Rng, ty: &Type, constants: &Constants, seen: &Seen) -> u64 {
    let near = |rng: &mut Rng, i: i64| i.wrapping_add(rng.i64(-1..=1));
    let bits = match rng.u8(..12) {
        0 => 0,
        1 => u64::MAX,
        2 => 1 << 7 << rng.choice([0, 8, 24, 56]).unwrap_or(0),
        3 => (1 << 7 << rng.choice([0, 8, 24, 56]).unwrap_or(0)) - 1,
        4..=6 => rng.i64(-4..=10).cast_unsigned(),
        7 => rng.u64(..=1000),
        8 => rng.u64(..),
        9 | 10 => {
            let i = rng.choice(&constants.integers).copied().unwrap_or(0);
            near(rng, i).cast_unsigned()
        }
        _ => {
            let i = rng.choice(&seen.integers).copied().unwrap_or(0);
            near(rng, i).cast_unsigned()
        }
    };
    normal(ty, bits)
}

fn a_duration(rng: &mut Rng, seen: &Seen) -> u64 {
    match rng.u8(..10) {
        0 => 0,
        1 => rng.choice([1, u64::MAX, u64::MAX / 2, MS - 1]).unwrap_or(1),
        2 => rng.u64(..),
        3..=5 => rng.u64(1..=100) * MS,
        6 | 7 => rng.u64(1..=10) * SECOND,
        _ => rng.choice(&seen.durations).copied().unwrap_or(SECOND),
    }
}

/// Time between two executions: most often the period, else none, a moment, what a timer waits for, days.
pub(super) fn elapsed(rng: &mut Rng, period: u64, seen: &Seen) -> u64 {
    match rng.u8(..24) {
        0 => 0,
        1 => 1,
        2 => rng.u64(1..SECOND),
        3 => rng.u64(1..=10) * SECOND,
        4 => rng.u64(1..=72) * HOUR,
        5 | 6 => {
            let known = rng.choice(&seen.durations).copied().unwrap_or(SECOND);
            known.saturating_add(rng.u64(..=2)).saturating_sub(1).min(72 * HOUR)
        }
        _ => period,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn types() -> Vec<Type> {
        let names = |n: &[&str]| -> Arc<[String]> { n.iter().map(|s| (*s).to_owned()).collect() };
        let words = [Type::Enum(names(&["a", "b", "c"])), Type::Flags(names(&["a", "b"]))];
        use Type::*;
        [Bool, U8, U16, U32, U64, S8, S16, S32, S64, F32, F64, Duration].into_iter().chain(words).collect()
    }

    #[test]
    fn every_value_is_a_legal_cell_of_its_type() {
        let constants = Constants { integers: vec![i64::MIN, -1, 4711], reals: vec![0.1, f64::NAN] };
        let mut rng = Rng::with_seed(1);
        for ty in types() {
            let mut seen = Seen::default();
            for _ in 0..5_000 {
                let cell = value(&mut rng, &ty, &constants, &seen);
                assert_eq!(normal(&ty, cell), cell, "{ty}");
                seen.note(&ty, cell);
            }
        }
    }

    #[test]
    fn edges_of_every_number_come_up() {
        let mut rng = Rng::with_seed(2);
        let (constants, seen) = (Constants::default(), Seen::default());
        for ty in types() {
            let cells: Vec<u64> = (0..5_000).map(|_| value(&mut rng, &ty, &constants, &seen)).collect();
            let has = |what: &str, is: &dyn Fn(u64) -> bool| {
                assert!(cells.iter().any(|c| is(*c)), "{ty}: {what} never came up");
            };
            has("zero", &|c| c == 0);
            match &ty {
                Type::F32 | Type::F64 => {
                    has("NaN", &|c| real(&ty, c).is_nan());
                    has("infinity", &|c| real(&ty, c) == f64::INFINITY);
                    has("negative zero", &|c| real(&ty, c) == 0.0 && real(&ty, c).is_sign_negative());
                    has("a subnormal", &|c| matches!(c, 1));
                }
                Type::Duration => has("the longest", &|c| c == u64::MAX),
                Type::Bool | Type::Enum(_) | Type::Flags(_) => {}
                _ => {
                    has("all bits", &|c| c == normal(&ty, u64::MAX));
                    has("one", &|c| c == 1);
                }
            }
        }
    }
}
