//! Numbers as text for refusals, to 12 significant digits.
//!
//! `core` prints a float exactly and takes some 30 KB of tables and big integers for it, more than a whole block may have.

use core::fmt::{self, Write};

const DIGITS: usize = 12;
/// Powers of ten with binary exponents: any decimal exponent is a sum of them.
const POWERS: [(i32, f64); 9] =
    [(256, 1e256), (128, 1e128), (64, 1e64), (32, 1e32), (16, 1e16), (8, 1e8), (4, 1e4), (2, 1e2), (1, 1e1)];

/// Shows a real number as `50`, `-0.5`, `1.25e300`, `NaN` or `inf`.
#[derive(Clone, Copy)]
pub(crate) struct Real(pub(crate) f64);

impl fmt::Display for Real {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_nan() {
            return f.write_str("NaN");
        }
        if self.0 < 0.0 {
            f.write_char('-')?;
        }
        if self.0.is_infinite() {
            return f.write_str("inf");
        }
        let (digits, exponent) = decimal(self.0.abs());
        // Without the zeros at the end.
        let count = digits.iter().rposition(|d| *d != b'0').map_or(1, |last| last.saturating_add(1));
        let mut digits = digits.iter().take(count).map(|d| char::from(*d));
        let whole = if (-5..15).contains(&exponent) { exponent } else { 0 };
        if whole < 0 {
            f.write_str("0.")?;
            (whole..-1).try_for_each(|_| f.write_char('0'))?;
        }
        for _ in 0..=whole {
            f.write_char(digits.next().unwrap_or('0'))?;
        }
        let mut point = whole >= 0;
        for digit in digits {
            if point {
                f.write_char('.')?;
            }
            point = false;
            f.write_char(digit)?;
        }
        if whole != exponent { write!(f, "e{exponent}") } else { Ok(()) }
    }
}

/// The digits of a finite, positive number, and the power of ten of the first.
fn decimal(mut value: f64) -> ([u8; DIGITS], i32) {
    let mut exponent = 0;
    for (power, factor) in POWERS {
        if value >= factor {
            value /= factor;
            exponent = power.saturating_add(exponent);
        } else if value > 0.0 && value * factor < 10.0 {
            value *= factor;
            exponent = power.saturating_neg().saturating_add(exponent);
        }
    }
    let mut rest = (value * 1e11 + 0.5) as u64;
    if rest >= 1_000_000_000_000 {
        rest /= 10;
        exponent = exponent.saturating_add(1);
    }
    let mut digits = [b'0'; DIGITS];
    for digit in digits.iter_mut().rev() {
        *digit = b'0' + (rest % 10) as u8;
        rest /= 10;
    }
    (digits, exponent)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    #[test]
    fn numbers_people_write_come_out_as_written() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (10.0, "10"),
            (-0.5, "-0.5"),
            (0.1, "0.1"),
            (0.00012, "0.00012"),
            (99.999, "99.999"),
            (123_456.75, "123456.75"),
            (32_767.0, "32767"),
            (1e14, "100000000000000"),
            (1e15, "1e15"),
            (1.25e300, "1.25e300"),
            (1e-9, "1e-9"),
            (5e-324, "4.94065645841e-324"),
            (f64::MAX, "1.79769313486e308"),
            (0.1 + 0.2, "0.3"),
            (9.999_999_999_999_9, "10"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
            (f64::NEG_INFINITY, "-inf"),
        ] {
            assert_eq!(Real(value).to_string(), text);
        }
    }

    proptest! {
        #[test]
        fn any_number_reads_back_to_twelve_digits(value in any::<f64>()) {
            let read: f64 = Real(value).to_string().parse().expect("a number");
            prop_assert!((read - value).abs() <= value.abs() * 1e-11, "{} for {value:e}", Real(value));
        }

        #[test]
        fn short_decimals_come_out_as_core_prints_them(digits in -99_999_999i64..99_999_999, places in 0..6i32) {
            let value = digits as f64 / 10f64.powi(places);
            prop_assert_eq!(Real(value).to_string(), (value + 0.0).to_string());
        }
    }
}
