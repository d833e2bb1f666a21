//! Something to say about a place of a file.

use crate::Span;

/// How serious a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// The file cannot be used.
    Error,
    /// It can, but probably not as its author thinks.
    Warning,
    /// Worth knowing.
    Note,
}

impl Severity {
    /// The word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

/// A finding: what was found, what was expected, the way out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// How serious.
    pub severity: Severity,
    /// Bytes of the file it is about; `None` for the file as a whole.
    pub span: Option<Span>,
    /// What was found and what was expected.
    pub message: String,
    /// The way out.
    pub help: Option<String>,
}

impl Finding {
    /// An error at a place.
    pub fn error(span: &Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Error, span: Some(span.clone()), message: message.into(), help: None }
    }

    /// A note at a place.
    pub fn note(span: &Span, message: impl Into<String>) -> Self {
        Self { severity: Severity::Note, span: Some(span.clone()), message: message.into(), help: None }
    }

    /// With a way out.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// With a way out, if there is one.
    pub fn maybe_help(mut self, help: Option<String>) -> Self {
        self.help = self.help.or(help);
        self
    }
}
