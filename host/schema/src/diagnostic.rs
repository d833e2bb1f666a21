//! Findings as a person reads them, with the line they are about, and as a script does.

use crate::{Finding, Severity};
use annotate_snippets::{AnnotationKind, Level, Renderer, Snippet};
use latchwork_image::plain;
use serde_json::{Value, json};
use std::borrow::Cow;
use std::path::Path;

/// All findings, one after the other, with a line that counts them.
pub fn render(findings: &[Finding], path: &Path, text: &str, colours: bool) -> String {
    let renderer = if colours { Renderer::styled() } else { Renderer::plain() };
    let path = plain(&path.display().to_string());
    let source = source(text);
    let mut out = String::new();
    for finding in findings {
        let level = match finding.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
            Severity::Note => Level::NOTE,
        };
        let title = if finding.span.is_some() {
            lines(&finding.message)
        } else {
            format!("{path}: {}", lines(&finding.message))
        };
        let mut group = level.primary_title(title.as_str()).elements(finding.span.as_ref().map(|span| {
            let span = span.start.min(text.len())..span.end.min(text.len()).max(span.start.min(text.len()));
            Snippet::source(source.as_ref()).path(path.as_str()).annotation(AnnotationKind::Primary.span(span))
        }));
        if let Some(help) = &finding.help {
            group = group.element(Level::HELP.message(lines(help)));
        }
        out += &renderer.render(&[group]);
        out += "\n\n";
    }
    out + &counts(findings)
}

/// A message, which quotes files and components, without what would act on a terminal.
fn lines(text: &str) -> String {
    text.split('\n').map(plain).collect::<Vec<_>>().join("\n")
}

/// The file for a terminal, every byte where it was: the renderer leaves those control characters as they are that have two.
fn source(text: &str) -> Cow<'_, str> {
    let acts = |c: char| matches!(c, '\u{80}'..='\u{9f}');
    if text.contains(acts) { text.replace(acts, "¿").into() } else { text.into() }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_a_finding_quotes_acts_on_a_terminal() {
        let text = "name = \"\u{9b}31m\u{7f}\u{1b}[2J\"\nb = 1\n";
        let message = "there is another case \"\u{1b}[2J\u{9b}\"\nand more";
        let finding = Finding::error(&(7..20), message).help("did you mean \"\u{7}\"?");
        let whole = Finding { span: None, ..Finding::error(&(0..0), message) };
        let shown = render(&[finding, whole], Path::new("a\u{1b}[2J.toml"), text, false);
        assert!(!shown.contains(|c: char| c.is_control() && c != '\n'), "{shown:?}");
        assert!(shown.contains("there is another case \"\\u{1b}[2J\\u{9b}\""), "{shown}");
        assert!(shown.contains("did you mean \"\\u{7}\"?"), "{shown}");
        assert!(shown.contains("a\\u{1b}[2J.toml:1:8"), "{shown}");
    }
}
