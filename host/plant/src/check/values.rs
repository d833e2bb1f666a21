//! Constants of the file as values of a type.

use latchwork_image::{Type, nearest};
use latchwork_schema::{Checker, Constant, Finding, Span};

/// Reads a constant as a value of a type; a finding when it does not fit.
pub(super) fn cell(checker: &mut Checker, ty: &Type, constant: &Constant, what: &str, span: &Span) -> Option<u64> {
    let read = match (ty, constant) {
        (_, Constant::Text(text)) if has_words(ty) => ty.parse(text),
        // Which case a number means changes with the component: only its name is a promise.
        (Type::Enum(_) | Type::Flags(_), Constant::Integer(i)) => Err(ty.refuse(i.to_string())),
        // A number that became infinite was not meant so.
        (Type::F32, Constant::Real(r)) if r.is_finite() && !(*r as f32).is_finite() => {
            let mut error = ty.refuse(format!("{r:?}"));
            error.expected = format!("a number {:e} to {:e}", f32::MIN, f32::MAX);
            Err(error)
        }
        _ => latchwork_io::sim::cell(ty, constant),
    };
    match read {
        Ok(cell) => Some(cell),
        Err(error) => {
            let message = format!("`{what}` is {}; it takes {}", error.found, error.expected);
            let help = match constant {
                Constant::Text(text) => near_word(ty, text).map(|n| format!("did you mean \"{n}\"?")),
                _ => None,
            };
            checker.add(Finding::error(span, message).maybe_help(help));
            None
        }
    }
}

/// Types whose values are written as strings.
pub(super) fn has_words(ty: &Type) -> bool {
    matches!(ty, Type::Duration | Type::Enum(_) | Type::Flags(_))
}

/// The case or flag that was probably meant.
pub(super) fn near_word<'t>(ty: &'t Type, text: &str) -> Option<&'t str> {
    match ty {
        Type::Enum(names) | Type::Flags(names) => nearest(text, names.iter().map(String::as_str)),
        _ => None,
    }
}
