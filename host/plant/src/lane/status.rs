//! Status registers: a change of one becomes an event record with the previous and the current register.
//!
//! A status register is an output of a flags type named `status`, as the objects of UNICOS CPC have one.

use super::Lane;
use latchwork_record::{Datum, Entry, Kind, SourceId, Text};
use std::fmt::Write;
use std::sync::Arc;

/// One status register of a block.
pub struct Register {
    /// Cell.
    pub cell: u32,
    /// Its value when it was last recorded.
    pub previous: u64,
    /// `BLOCK.outputs.status`
    pub source: SourceId,
    /// Names of its flags, by bit.
    pub names: Arc<[String]>,
}

impl Lane {
    /// One record per register that has changed.
    #[cold]
    pub(super) fn status_changed(&mut self, index: usize, now: u64) {
        let parts = &mut self.parts;
        let block = &mut parts.blocks[index];
        for register in &mut block.rest.status {
            let current = parts.cells[register.cell as usize];
            let previous = std::mem::replace(&mut register.previous, current);
            if current != previous {
                let mut entry = Entry::new(now, Kind::Event, register.source, "changed")
                    .change(Datum::Integer(previous as i64), Datum::Integer(current as i64));
                entry.text = differences(previous, current, &register.names);
                parts.recorder.push(entry);
            }
        }
        if let (Some((_, previous)), Some(first)) = (&mut block.status, block.rest.status.first()) {
            *previous = first.previous;
        }
    }
}

/// `+on -io-error`: flags that were set and cleared.
fn differences(previous: u64, current: u64, names: &[String]) -> Text {
    let mut text = Text::default();
    let mut changed = previous ^ current;
    while changed != 0 {
        let bit = changed.trailing_zeros();
        changed &= changed - 1;
        let Some(name) = names.get(bit as usize) else { continue };
        let sign = if current >> bit & 1 == 1 { '+' } else { '-' };
        let space = if text.as_str().is_empty() { "" } else { " " };
        // What does not fit is cut.
        let _ = write!(text, "{space}{sign}{name}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::differences;

    #[test]
    fn an_event_names_the_flags_that_changed() {
        let names: Vec<String> = ["on", "forced", "io-error"].map(String::from).to_vec();
        assert_eq!(differences(0b001, 0b110, &names).as_str(), "-on +forced +io-error");
        assert_eq!(differences(0, 1 << 40, &names).as_str(), "");
    }
}
