//! The 16-bit configuration code of an alarm or command variable (portable vacuum pumping station).
//!
//! | bit | meaning | | bit | meaning while the plant runs |
//! |---|---|---|---|---|
//! | 15 | audit trail | | 5 | acknowledged |
//! | 14 | alarm | | 4 | memory: was active |
//! | 13 | warning | | 1 | to acknowledge |
//! | 12 | message | | 0 | active now |
//! | 11 | resettable | | | |
//! | 10 | acknowledge | | | |

use std::fmt;

/// The nine kinds that a code can name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CodeKind {
    /// `0xC800`: logged alarm, must be reset.
    AlarmReset,
    /// `0xC000`: logged alarm, resets itself.
    Alarm,
    /// `0xCC00`: logged alarm, must be acknowledged and reset.
    AlarmAcknowledgeReset,
    /// `0xC400`: logged alarm, resets itself, must be acknowledged.
    AlarmAcknowledge,
    /// `0xA000`: logged warning.
    Warning,
    /// `0xB000`: message to log.
    Message,
    /// `0x9000`: command, toggle.
    CommandToggle,
    /// `0x9080`: command, one-shot.
    CommandOneShot,
    /// `0xA080`: command, retained.
    CommandRetained,
}

impl CodeKind {
    /// All of them, in the order of the specification's table.
    pub const ALL: [Self; 9] = [
        Self::AlarmReset,
        Self::Alarm,
        Self::AlarmAcknowledgeReset,
        Self::AlarmAcknowledge,
        Self::Warning,
        Self::Message,
        Self::CommandToggle,
        Self::CommandOneShot,
        Self::CommandRetained,
    ];

    /// Its configuration bits.
    pub fn bits(self) -> u16 {
        match self {
            Self::AlarmReset => 0xC800,
            Self::Alarm => 0xC000,
            Self::AlarmAcknowledgeReset => 0xCC00,
            Self::AlarmAcknowledge => 0xC400,
            Self::Warning => 0xA000,
            Self::Message => 0xB000,
            Self::CommandToggle => 0x9000,
            Self::CommandOneShot => 0x9080,
            Self::CommandRetained => 0xA080,
        }
    }

    /// What it is, for a person.
    pub fn words(self) -> &'static str {
        match self {
            Self::AlarmReset => "logged alarm, must be reset",
            Self::Alarm => "logged alarm, resets itself",
            Self::AlarmAcknowledgeReset => "logged alarm, must be acknowledged and reset",
            Self::AlarmAcknowledge => "logged alarm, resets itself, must be acknowledged",
            Self::Warning => "logged warning",
            Self::Message => "message to log",
            Self::CommandToggle => "command, toggle",
            Self::CommandOneShot => "command, one-shot",
            Self::CommandRetained => "command, retained",
        }
    }

    /// True for the kinds that have the life of an alarm, warnings and messages among them.
    pub fn is_alarm(self) -> bool {
        !matches!(self, Self::CommandToggle | Self::CommandOneShot | Self::CommandRetained)
    }

    /// It stays listed until it has been acknowledged (bit 10).
    pub fn must_be_acknowledged(self) -> bool {
        self.is_alarm() && self.bits() & 0x0400 != 0
    }

    /// It stays listed until it has been reset after the condition has gone (bit 11).
    pub fn must_be_reset(self) -> bool {
        self.is_alarm() && self.bits() & 0x0800 != 0
    }
}

/// A code that is one of the nine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Code(CodeKind);

/// A code that is none.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{variable}` has the code {code:#06X} ({code}), which is none of the nine: 0xC800, 0xC000, 0xCC00 and 0xC400 are alarms, \
     0xA000 is a warning, 0xB000 a message, 0x9000, 0x9080 and 0xA080 are commands"
)]
pub struct CodeError {
    /// The variable.
    pub variable: String,
    /// Its code.
    pub code: u16,
}

impl Code {
    /// A code from its 16 bits, for a variable.
    ///
    /// # Errors
    /// Any bits that are none of the nine codes; the error names the variable.
    pub fn new(bits: u16, variable: &str) -> Result<Self, CodeError> {
        let kind = CodeKind::ALL.into_iter().find(|k| k.bits() == bits);
        kind.map(Self).ok_or_else(|| CodeError { variable: variable.into(), code: bits })
    }

    /// Its kind.
    pub fn kind(self) -> CodeKind {
        self.0
    }
}

impl From<CodeKind> for Code {
    fn from(kind: CodeKind) -> Self {
        Self(kind)
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#06X}", self.0.bits())
    }
}
