//! What was expected against what is there.

use super::model::Expected;
use super::report::Mismatch;
use latchwork_image::{Quality, Type, format_duration};

/// Notes where the cells are not as expected.
pub fn compare(expected: &Expected, cells: &[u64], mismatches: &mut Vec<Mismatch>) {
    let Expected { name, ty, cell, value, within, quality } = expected;
    if let Some(value) = value
        && !equal(ty, *value, cells[*cell], *within)
    {
        let mut wanted = ty.format(*value);
        if *within > 0.0 {
            let within = if *ty == Type::Duration { format_duration(*within as u64) } else { within.to_string() };
            wanted = format!("{wanted} ± {within}");
        }
        mismatches.push(Mismatch { what: name.clone(), expected: wanted, got: ty.format(cells[*cell]) });
    }
    if let Some(quality) = quality {
        let got = Quality::from_cell(cells[cell + 1]);
        if got != *quality {
            let (expected, got) = (quality.name().into(), got.name().into());
            mismatches.push(Mismatch { what: format!("{name}.quality"), expected, got });
        }
    }
}

/// Zeros are equal whatever their sign, and so is all that is no number.
fn equal(ty: &Type, expected: u64, got: u64, within: f64) -> bool {
    let real = |cell: u64| match ty {
        Type::F32 => f64::from(f32::from_bits(cell as u32)),
        _ => f64::from_bits(cell),
    };
    match ty {
        Type::F32 | Type::F64 => {
            let (expected, got) = (real(expected), real(got));
            expected == got || (expected.is_nan() && got.is_nan()) || (expected - got).abs() <= within
        }
        Type::Bool | Type::Enum(_) | Type::Flags(_) => expected == got,
        Type::S8 | Type::S16 | Type::S32 => {
            let number = |cell: u64| i64::from((cell as u32).cast_signed());
            number(expected).abs_diff(number(got)) as f64 <= within
        }
        Type::S64 => expected.cast_signed().abs_diff(got.cast_signed()) as f64 <= within,
        _ => expected.abs_diff(got) as f64 <= within,
    }
}
