//! Quality of a signal, as in `latchwork:block/types`.

use serde::Serialize;

/// How far a value can be trusted. The numbers are the discriminants of the WIT enum `quality`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum Quality {
    /// Fresh and plausible.
    #[default]
    Good = 0,
    /// Usable with care, for example a value that was held or forced by its source.
    Uncertain = 1,
    /// Not to be trusted: the peer is away, the block has faulted, nothing was read yet.
    Bad = 2,
}

impl Quality {
    /// From a cell; anything out of range counts as bad, the safe reading.
    pub fn from_cell(cell: u64) -> Self {
        match cell {
            0 => Self::Good,
            1 => Self::Uncertain,
            _ => Self::Bad,
        }
    }

    /// As a cell.
    pub fn cell(self) -> u64 {
        self as u64
    }

    /// `good`, `uncertain` or `bad`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Uncertain => "uncertain",
            Self::Bad => "bad",
        }
    }
}

impl std::fmt::Display for Quality {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}
