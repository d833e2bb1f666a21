//! What a check has found.

use serde::Serialize;

/// How good it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Status {
    /// As it should be.
    Ok,
    /// It works, but could be better, or is not needed here.
    Note,
    /// The plant will not be on time, or will not work.
    Bad,
}

impl Status {
    /// The word in reports.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Note => "note",
            Self::Bad => "bad",
        }
    }

    /// `Bad` where it is needed, else `Note`.
    pub(super) fn bad_if(needed: bool) -> Self {
        if needed { Self::Bad } else { Self::Note }
    }
}

/// One line of the report.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Finding {
    /// Name of the check; does not change between versions.
    pub(crate) check: &'static str,
    /// How good it is.
    pub(crate) status: Status,
    /// What was found.
    pub(crate) found: String,
    /// Why that matters, one sentence.
    pub(crate) why: &'static str,
    /// What mends it: commands for a shell, or lines for a plant file, in order. A line that begins with `#` is for a person.
    pub(crate) mend: Vec<String>,
}

impl Finding {
    /// Nothing to do.
    pub(super) fn ok(check: &'static str, why: &'static str, found: impl Into<String>) -> Self {
        Self { check, status: Status::Ok, found: found.into(), why, mend: Vec::new() }
    }

    /// Something to mend.
    pub(super) fn wanting(
        status: Status,
        check: &'static str,
        why: &'static str,
        found: impl Into<String>,
        mend: Vec<String>,
    ) -> Self {
        Self { check, status, found: found.into(), why, mend }
    }
}
