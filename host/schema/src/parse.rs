//! From text to tables, with what is wrong about the text itself.

use crate::{Finding, Span};
use toml::Spanned;
use toml::de::DeTable;

/// Parses a file; every syntax error is a finding.
pub fn parse(text: &str) -> (Spanned<DeTable<'_>>, Vec<Finding>) {
    let (table, errors) = DeTable::parse_recoverable(text);
    let mut findings: Vec<Finding> = Vec::new();
    // Bytes of a table that stands there for the second time: all its keys do so too, which says nothing new.
    let mut repeated = 0..0;
    for error in &errors {
        let span = error.span().unwrap_or(0..text.len().min(1));
        let words = text.get(span.clone()).unwrap_or_default();
        let finding = match error.message() {
            "duplicate key" if repeated.contains(&span.start) => continue,
            "duplicate key" => {
                if is_header(text, &span) {
                    repeated = span.end..end_of_table(text, span.end);
                }
                Finding::error(&span, format!("`{words}` stands here for the second time")).help(
                    "keep one of them; a table is written in one piece, either with dots (`inputs.a = …`) or with a \
                     header of its own",
                )
            }
            message => match message.strip_prefix("string values must be quoted") {
                Some(_) => Finding::error(&span, format!("`{words}` is no value; a string stands in quotes"))
                    .help(format!("write \"{words}\"")),
                None => Finding::error(&span, format!("this is no TOML: {message}")),
            },
        };
        findings.push(finding);
    }
    (table, findings)
}

/// The line a span begins in opens a table.
fn is_header(text: &str, span: &Span) -> bool {
    let before = text.get(..span.start).unwrap_or_default();
    before.lines().next_back().is_some_and(|line| line.trim_start().starts_with('[') && !before.ends_with('\n'))
}

/// Where the next table begins.
fn end_of_table(text: &str, from: usize) -> usize {
    text.get(from..).and_then(|rest| rest.find("\n[")).map_or(text.len(), |n| from + n)
}
