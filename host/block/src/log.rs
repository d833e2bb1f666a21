//! Messages of a block: bounded in length and number, kept until they are taken.

use wasmtime::component::{ComponentType, Lift};

/// Most bytes kept of one message.
pub(crate) const LENGTH: usize = 256;
/// Most messages kept until they are taken.
const MESSAGES: usize = 16;

/// How serious a message is, as in `latchwork:block/log`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ComponentType, Lift)]
#[component(enum)]
#[repr(u8)]
pub enum Level {
    /// For the author of the block.
    #[component(name = "debug")]
    Debug,
    /// Worth knowing.
    #[component(name = "info")]
    Info,
    /// Will need attention.
    #[component(name = "warning")]
    Warning,
    /// Went wrong.
    #[component(name = "error")]
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

    /// From the discriminant in the canonical ABI.
    pub(crate) fn from_discriminant(d: u32) -> Option<Self> {
        [Self::Debug, Self::Info, Self::Warning, Self::Error].get(d as usize).copied()
    }
}

/// The messages of one instance. All memory is taken when it is made.
#[derive(Default)]
pub(crate) struct LogBuffer {
    kept: usize,
    dropped: u64,
    messages: Box<[Message]>,
}

#[derive(Clone)]
struct Message {
    level: Level,
    length: u16,
    text: [u8; LENGTH],
}

impl LogBuffer {
    /// A buffer for a component that logs.
    pub(crate) fn new() -> Self {
        let empty = Message { level: Level::Debug, length: 0, text: [0; LENGTH] };
        Self { kept: 0, dropped: 0, messages: vec![empty; MESSAGES].into() }
    }

    /// Something waits to be taken.
    #[inline]
    pub(crate) fn waiting(&self) -> bool {
        self.kept > 0
    }

    /// True if the next message will be kept. If not, it is counted as dropped.
    pub(crate) fn admit(&mut self) -> bool {
        let room = self.kept < self.messages.len();
        if !room {
            self.dropped += 1;
        }
        room
    }

    /// Keeps a message that was admitted, cut to what fits.
    pub(crate) fn push(&mut self, level: Level, text: &str) {
        let Some(message) = self.messages.get_mut(self.kept) else { return };
        let text = cut(text);
        message.level = level;
        message.length = text.len() as u16;
        message.text[..text.len()].copy_from_slice(text.as_bytes());
        self.kept += 1;
    }

    /// Hands out all messages and the number of dropped ones.
    pub(crate) fn drain(&mut self, mut take: impl FnMut(Level, &str)) -> u64 {
        for message in &self.messages[..std::mem::take(&mut self.kept)] {
            // Only whole characters were put in.
            take(message.level, std::str::from_utf8(&message.text[..usize::from(message.length)]).unwrap_or_default());
        }
        std::mem::take(&mut self.dropped)
    }
}

/// The longest beginning of a text that is kept, ending with a whole character.
pub(crate) fn cut(text: &str) -> &str {
    &text[..text.floor_char_boundary(LENGTH)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_cut_at_a_character_and_a_flood_is_counted() {
        let mut log = LogBuffer::new();
        for _ in 0..20 {
            if log.admit() {
                log.push(Level::Warning, &"ä".repeat(200));
            }
        }
        assert!(log.waiting());
        let mut taken = Vec::new();
        assert_eq!(log.drain(|l, t| taken.push((l, t.to_string()))), 4);
        assert_eq!(taken.len(), 16);
        assert_eq!(taken[0], (Level::Warning, "ä".repeat(128)));
        assert!(!log.waiting());
        assert_eq!(log.drain(|_, _| ()), 0);
    }

    #[test]
    fn a_character_that_does_not_fit_is_left_out_whole() {
        let text = format!("{}ä", "x".repeat(255));
        assert_eq!(cut(&text).len(), 255);
    }
}
