//! Simpler values in place of a value.

use super::values::{normal, real, real_cell};
use latchwork_image::Type;

/// Values to try instead of `cell`, each simpler than it, the simplest first.
pub(super) fn simpler(ty: &Type, cell: u64) -> Vec<u64> {
    let mut list = match ty {
        Type::Bool | Type::Enum(_) => vec![0],
        Type::Flags(names) => {
            let mut list = vec![0];
            list.extend((0..names.len()).map(|bit| cell & !(1 << bit)));
            list
        }
        Type::F32 | Type::F64 => reals(real(ty, cell)).into_iter().map(|r| real_cell(ty, r)).collect(),
        _ => integers(ty, cell),
    };
    let weight_before = weight(ty, cell);
    list.retain(|c| weight(ty, *c) < weight_before);
    list.sort_by_key(|c| weight(ty, *c));
    list.dedup();
    list
}

/// How hard a value is to read; then how large it is.
fn weight(ty: &Type, cell: u64) -> (usize, u64) {
    match ty {
        Type::Bool | Type::Enum(_) => (0, cell),
        Type::Flags(_) => (cell.count_ones() as usize, cell),
        Type::F32 | Type::F64 => {
            let r = real(ty, cell);
            let odd = if r.is_nan() {
                1000
            } else if r.is_infinite() {
                900
            } else {
                0
            };
            // Only one NaN has a name.
            let unnamed = usize::from(r.is_nan() && cell != real_cell(ty, f64::NAN));
            let negative_zero = usize::from(r == 0.0 && r.is_sign_negative());
            (odd + unnamed + negative_zero + digits(&ty.format(cell)), r.abs().to_bits())
        }
        Type::S8 | Type::S16 | Type::S32 | Type::S64 => {
            let text = ty.format(cell);
            (digits(&text), text.parse::<i128>().map_or(0, i128::unsigned_abs) as u64)
        }
        // A file has no room for more.
        Type::U64 if cell > i64::MAX.cast_unsigned() => (100, cell),
        _ => (digits(&ty.format(cell)), cell),
    }
}

/// Characters, twice; zeros at the end are easier to read.
fn digits(text: &str) -> usize {
    let text = text.strip_suffix(".0").unwrap_or(text);
    let zeros = text.len() - text.trim_end_matches('0').len();
    2 * text.len() - zeros
}

fn reals(r: f64) -> Vec<f64> {
    if r.is_nan() {
        return vec![0.0, 1.0, -1.0, 1e9, -1e9, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
    }
    if r.is_infinite() {
        return [0.0, 1.0, 100.0, 1e9, 1e300].map(|v: f64| v.copysign(r)).to_vec();
    }
    let mut list = vec![0.0, 1.0, -r, r.trunc(), r.round(), r / 10.0, r / 2.0, r - 1f64.copysign(r)];
    for places in 0..4 {
        // To so many digits behind the first, rounded either way.
        let rounded: f64 = format!("{r:.places$e}").parse().unwrap_or(r);
        let step = 10f64.powf(r.abs().log10().floor() - places as f64);
        list.extend([rounded, rounded + step, rounded - step]);
    }
    list
}

fn integers(ty: &Type, cell: u64) -> Vec<u64> {
    const UNITS: [i128; 5] = [1_000, 1_000_000, 1_000_000_000, 60_000_000_000, 3_600_000_000_000];
    let value = match ty {
        Type::S8 | Type::S16 | Type::S32 => i128::from((cell as u32).cast_signed()),
        Type::S64 => i128::from(cell.cast_signed()),
        _ => i128::from(cell),
    };
    let mut list = vec![0, 1, -value, value / 2, value / 10, value - value.signum()];
    let mut power = 10;
    while power <= value.abs() {
        let (rounded, step) = (value - value % power, power * value.signum());
        list.extend([rounded, rounded + step, rounded - step]);
        power *= 10;
    }
    if *ty == Type::Duration {
        list.extend(UNITS.iter().flat_map(|u| [*u, 2 * u, value - value % u]));
    }
    let cells = list.into_iter().filter_map(|v| ty.cell_from_integer(v));
    cells.filter(|c| normal(ty, *c) == *c).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where greedy steps end when everything that `fails` is as good.
    fn smallest(ty: &Type, mut cell: u64, fails: impl Fn(u64) -> bool) -> String {
        while let Some(simple) = simpler(ty, cell).into_iter().find(|c| fails(*c)) {
            cell = simple;
        }
        ty.format(cell)
    }

    #[test]
    fn numbers_shrink_to_what_a_person_would_write() {
        let r = |cell: u64| f64::from_bits(cell);
        let f64 = |r: f64, fails: &dyn Fn(f64) -> bool| smallest(&Type::F64, r.to_bits(), |c| fails(f64::from_bits(c)));
        assert_eq!(f64(73_123.456, &|r| r > 100.0), "200.0");
        assert_eq!(f64(-73_123.456, &|r| r < -0.5), "-1.0");
        assert_eq!(f64(f64::NAN, &|_| true), "0.0");
        assert_eq!(f64(f64::from_bits(0x7ff8_dead_beef_cafe), &f64::is_nan), "NaN");
        assert_eq!(f64(f64::INFINITY, &|r| r > 5.0), "6.0");
        assert_eq!(smallest(&Type::F64, 20.1f64.to_bits(), |c| (20.05..20.2).contains(&r(c))), "20.1");
        assert_eq!(smallest(&Type::U16, 54_321, |c| c > 4_000), "5000");
        assert_eq!(
            smallest(&Type::S32, u64::from((-7_777i32).cast_unsigned()), |c| (c as u32).cast_signed() < -3),
            "-4"
        );
        assert_eq!(smallest(&Type::Duration, 7_654_321_987, |c| c > 1_500_000_000), "2s");
        assert_eq!(smallest(&Type::Duration, 61_234_567_890_123, |c| c > 3_600_000_000_000), "2h");
        assert_eq!(smallest(&Type::U64, u64::MAX, |c| c > 1 << 40), "2000000000000");
    }
}
