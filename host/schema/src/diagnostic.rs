//! Findings as a person reads them, with the line they are about, and as a script does.

use crate::{Finding, Severity};
use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use serde_json::{Value, json};
use std::path::Path;

/// All findings, one after the other, with a line that counts them.
pub fn render(findings: &[Finding], path: &Path, text: &str, colours: bool) -> String {
    let renderer = if colours { Renderer::styled() } else { Renderer::plain() };
    let path = path.display().to_string();
    let mut out = String::new();
    for finding in findings {
        let level = match finding.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
            Severity::Note => Level::NOTE,
        };
        let title =
            if finding.span.is_some() { finding.message.clone() } else { format!("{path}: {}", finding.message) };
        let mut group = level.primary_title(title.as_str()).elements(finding.span.as_ref().map(|span| {
            let span = span.start.min(text.len())..span.end.min(text.len()).max(span.start.min(text.len()));
            Snippet::source(text).path(path.as_str()).annotation(AnnotationKind::Primary.span(span))
        }));
        if let Some(help) = &finding.help {
            group = group.element(Level::HELP.message(help.as_str()));
        }
        out += &renderer.render(&[group]);
        out += "\n\n";
    }
    out + &counts(findings)
}

fn counts(findings: &[Finding]) -> String {
    let count = |severity| findings.iter().filter(|f| f.severity == severity).count();
    let parts: Vec<_> = [(Severity::Error, "error"), (Severity::Warning, "warning"), (Severity::Note, "note")]
        .into_iter()
        .map(|(s, word)| (count(s), word))
        .filter(|(n, _)| *n > 0)
        .map(|(n, word)| format!("{n} {word}{}", if n == 1 { "" } else { "s" }))
        .collect();
    if parts.is_empty() { String::new() } else { format!("{}\n", parts.join(", ")) }
}

/// `[{severity, file, line, column, end-line, end-column, message, help}]`; lines and columns from 1, in characters.
pub fn findings_json(findings: &[Finding], path: &Path, text: &str) -> Value {
    let path = path.display().to_string();
    findings
        .iter()
        .map(|f| {
            let mut entry =
                json!({ "severity": f.severity.name(), "file": path, "message": f.message, "help": f.help });
            if let Some(span) = &f.span {
                let (line, column) = position(text, span.start);
                let (end_line, end_column) = position(text, span.end);
                entry["line"] = json!(line);
                entry["column"] = json!(column);
                entry["end-line"] = json!(end_line);
                entry["end-column"] = json!(end_column);
            }
            entry
        })
        .collect()
}

/// Line and column of a byte, from 1.
pub fn position(text: &str, byte: usize) -> (usize, usize) {
    let before = &text[..text.floor_char_boundary(byte.min(text.len()))];
    let line_start = before.rfind('\n').map_or(0, |n| n + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}
