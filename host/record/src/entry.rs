//! An entry: a record as a lane makes it, of fixed size, without allocation.

use arrayvec::ArrayString;
use latchwork_image::Value;
use serde::Serialize;
use std::fmt::Write;

/// Bytes of text one entry can carry.
pub const TEXT_BYTES: usize = 232;

/// The kinds of `latchwork:journal/types.kind`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// An alarm changed its state.
    Alarm,
    /// An operator's or script's command.
    Command,
    /// A setting was written or refused.
    Setting,
    /// A status changed.
    Event,
    /// A block said something.
    Message,
    /// A driver or its peer changed its state.
    Io,
    /// A lane started, stopped, overran.
    Lane,
    /// A block or lane failed.
    Fault,
    /// A component was replaced.
    Swap,
    /// Who did what.
    Audit,
    /// A sign of life.
    Heartbeat,
    /// Entries that did not fit a queue, with their number.
    Lost,
}

impl Kind {
    /// All kinds, in the order of their numbers.
    pub const ALL: [Self; 12] = [
        Self::Alarm,
        Self::Command,
        Self::Setting,
        Self::Event,
        Self::Message,
        Self::Io,
        Self::Lane,
        Self::Fault,
        Self::Swap,
        Self::Audit,
        Self::Heartbeat,
        Self::Lost,
    ];

    /// The kind of a number, as `kind as u8` gives it.
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// The word in files: `alarm`, `io`, …
    pub fn name(self) -> &'static str {
        match self {
            Self::Alarm => "alarm",
            Self::Command => "command",
            Self::Setting => "setting",
            Self::Event => "event",
            Self::Message => "message",
            Self::Io => "io",
            Self::Lane => "lane",
            Self::Fault => "fault",
            Self::Swap => "swap",
            Self::Audit => "audit",
            Self::Heartbeat => "heartbeat",
            Self::Lost => "lost",
        }
    }
}

/// Number of a source in the router's table of names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SourceId(pub u32);

/// A value before or after a transition.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Datum {
    /// None.
    #[default]
    None,
    /// A boolean.
    Boolean(bool),
    /// A whole number.
    Integer(i64),
    /// A real number.
    Real(f64),
}

impl From<Datum> for Value {
    fn from(datum: Datum) -> Self {
        match datum {
            Datum::None => Self::None,
            Datum::Boolean(b) => Self::Boolean(b),
            Datum::Integer(i) => Self::Integer(i.into()),
            Datum::Real(r) => Self::Real(r),
        }
    }
}

/// Text of an entry; what does not fit is cut at a character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Text(ArrayString<TEXT_BYTES>);

impl Text {
    /// From a string, cut if too long.
    pub fn new(text: &str) -> Self {
        let mut t = Self::default();
        t.push(text);
        t
    }

    /// From `format_args!`, without allocation, cut if too long.
    pub fn format(args: std::fmt::Arguments<'_>) -> Self {
        let mut t = Self::default();
        // Writing to `Text` never fails.
        let _ = t.write_fmt(args);
        t
    }

    /// Appends as much as fits.
    pub fn push(&mut self, text: &str) {
        let room = self.0.remaining_capacity();
        let cut = if text.len() <= room { text.len() } else { text.floor_char_boundary(room) };
        self.0.push_str(&text[..cut]);
    }

    /// As a string.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Write for Text {
    fn write_str(&mut self, s: &str) -> std::fmt::Result {
        self.push(s);
        Ok(())
    }
}

/// One record on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Plant time, ns.
    pub time: u64,
    /// Kind.
    pub kind: Kind,
    /// What it is about.
    pub source: SourceId,
    /// What happened, in one word.
    pub transition: &'static str,
    /// Value before.
    pub previous: Datum,
    /// Value after.
    pub current: Datum,
    /// 0 (a note) to 255 (the plant is in danger).
    pub priority: u8,
    /// One sentence for a person; may be empty.
    pub text: Text,
}

impl Entry {
    /// An entry without values and text.
    pub fn new(time: u64, kind: Kind, source: SourceId, transition: &'static str) -> Self {
        Self {
            time,
            kind,
            source,
            transition,
            previous: Datum::None,
            current: Datum::None,
            priority: 0,
            text: Text::default(),
        }
    }

    /// With a priority.
    pub fn priority(mut self, priority: u8) -> Self {
        self.priority = priority;
        self
    }

    /// With values before and after.
    pub fn change(mut self, previous: Datum, current: Datum) -> Self {
        self.previous = previous;
        self.current = current;
        self
    }

    /// With a text.
    pub fn text(mut self, args: std::fmt::Arguments<'_>) -> Self {
        self.text = Text::format(args);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_cut_at_a_character() {
        let text = Text::new(&"ä".repeat(TEXT_BYTES));
        assert_eq!(text.as_str().len(), TEXT_BYTES);
        let text = Text::format(format_args!("x{}", "ä".repeat(TEXT_BYTES)));
        assert_eq!(text.as_str().len(), TEXT_BYTES - 1);
    }
}
