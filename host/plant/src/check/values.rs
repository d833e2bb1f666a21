//! Constants of the file as values of a type.

use latchwork_image::Type;
use latchwork_schema::{Checker, Constant, Span};
pub(super) use latchwork_schema::{has_words, near_word};

/// Reads a constant as a value of a type; a finding when it does not fit.
pub(super) fn cell(checker: &mut Checker, ty: &Type, constant: &Constant, what: &str, span: &Span) -> Option<u64> {
    checker.cell(ty, constant, what, span)
}
