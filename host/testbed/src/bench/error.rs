//! What is in the way of a bench.

use latchwork_block::{Fault, LoadError};
use latchwork_image::ParseValueError;
use std::path::PathBuf;

/// What is in the way of a bench.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// There is no such component.
    #[error("there is no component \"{name}\"; searched in {}", .searched.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", "))]
    NotFound {
        /// What was asked for.
        name: String,
        /// Where.
        searched: Vec<PathBuf>,
    },
    /// It cannot be loaded.
    #[error("{path}: {error}")]
    Load {
        /// Its place.
        path: String,
        /// Why.
        error: LoadError,
    },
    /// It faulted before its first execution.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// It refuses its settings.
    #[error("it refuses its settings: {0}")]
    Refused(String),
    /// The class has no such setting.
    #[error("there is no setting `{name}`; {}", hint(.nearest.as_deref(), .has))]
    NoSetting {
        /// What was given.
        name: String,
        /// The setting whose name is nearest.
        nearest: Option<String>,
        /// Those there are.
        has: Vec<String>,
    },
    /// A value that does not fit.
    #[error("`{name}`: {error}")]
    Value {
        /// Of which port.
        name: String,
        /// Why.
        error: ParseValueError,
    },
    /// A text that is no duration.
    #[error(transparent)]
    Duration(#[from] latchwork_image::DurationError),
}

/// What was meant, or what there is.
pub(super) fn hint(nearest: Option<&str>, has: &[impl AsRef<str>]) -> String {
    match nearest {
        Some(near) => format!("did you mean `{near}`?"),
        None if has.is_empty() => "the class has none".into(),
        None => format!("there are {}", has.iter().map(AsRef::as_ref).collect::<Vec<_>>().join(", ")),
    }
}
