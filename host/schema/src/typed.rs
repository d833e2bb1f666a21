//! Constants of a file as values of a port's type.

use crate::{Checker, Constant, Finding, Span};
use latchwork_image::{ParseValueError, Type, nearest};

/// A constant of the file as a cell of a type.
pub fn cell(ty: &Type, constant: &Constant) -> Result<u64, ParseValueError> {
    match (ty, constant) {
        (Type::Bool, Constant::Bool(b)) => Ok(u64::from(*b)),
        (_, Constant::Bool(b)) => Err(ty.refuse(b.to_string())),
        // 0 and 1 are no booleans in a file, and a duration has its unit. Which case a number means changes with the
        // component: only its name is a promise.
        (Type::Bool | Type::Duration | Type::Enum(_) | Type::Flags(_), Constant::Integer(i)) => {
            Err(ty.refuse(i.to_string()))
        }
        (_, Constant::Integer(i)) => ty.cell_from_integer((*i).into()).ok_or_else(|| ty.refuse(i.to_string())),
        // A number that became infinite was not meant so.
        (Type::F32, Constant::Real(r)) if r.is_finite() && !(*r as f32).is_finite() => {
            let mut error = ty.refuse(format!("{r:?}"));
            error.expected = format!("a number {:e} to {:e}", f32::MIN, f32::MAX);
            Err(error)
        }
        (_, Constant::Real(r)) => ty.cell_from_real(*r).ok_or_else(|| ty.refuse(r.to_string())),
        (_, Constant::Text(text)) if has_words(ty) => ty.parse(text),
        // TOML's numbers end at 2^63 - 1.
        (Type::U64, Constant::Text(text)) if text.parse::<u64>().is_ok_and(|n| i64::try_from(n).is_err()) => {
            ty.parse(text)
        }
        (_, Constant::Text(text)) => Err(ty.refuse(format!("\"{text}\""))),
    }
}

/// Types whose values are written as strings.
pub fn has_words(ty: &Type) -> bool {
    matches!(ty, Type::Duration | Type::Enum(_) | Type::Flags(_))
}

/// The case or flag that was probably meant.
pub fn near_word<'t>(ty: &'t Type, text: &str) -> Option<&'t str> {
    match ty {
        Type::Enum(names) | Type::Flags(names) => nearest(text, names.iter().map(String::as_str)),
        _ => None,
    }
}

impl Checker {
    /// Reads a constant as a value of a type; a finding when it does not fit.
    pub fn cell(&mut self, ty: &Type, constant: &Constant, what: &str, span: &Span) -> Option<u64> {
        match cell(ty, constant) {
            Ok(cell) => Some(cell),
            Err(error) => {
                let message = format!("`{what}` is {}; it takes {}", error.found, error.expected);
                let help = match constant {
                    Constant::Text(text) => near_word(ty, text).map(|n| format!("did you mean \"{n}\"?")),
                    _ => None,
                };
                self.add(Finding::error(span, message).maybe_help(help));
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_toml_has_not_are_strings() {
        let u64 = |text: &str| cell(&Type::U64, &Constant::Text(text.into())).ok();
        assert_eq!(u64("18446744073709551615"), Some(u64::MAX));
        assert_eq!(u64("9223372036854775808"), Some(1 << 63));
        // What has a number is one.
        assert_eq!((u64("9223372036854775807"), u64("12"), u64("18446744073709551616")), (None, None, None));
    }
}
