//! Messages of a block: bounded in length and number, kept until they are taken.

/// How serious a message is, as in `latchwork:block/log`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// For the author of the block.
    Debug,
    /// Worth knowing.
    Info,
    /// Will need attention.
    Warning,
    /// Went wrong.
    Error,
}

impl Level {
    /// `debug`, `info`, `warning` or `error`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Debug => "debug",
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }

    /// Priority of the record it becomes, 0 to 255.
    pub fn priority(self) -> u8 {
        match self {
            Self::Debug => 0,
            Self::Info => 20,
            Self::Warning => 100,
            Self::Error => 150,
        }
    }
}
