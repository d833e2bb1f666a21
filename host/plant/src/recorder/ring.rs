//! The ring in memory.

use latchwork_testbed::replay::header;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Segments as they stand in a file, the oldest first, and the components they need.
#[derive(Default)]
pub(super) struct Ring {
    memory: u64,
    segments: VecDeque<(String, Vec<u8>)>,
    bytes: u64,
    components: BTreeMap<String, Vec<u8>>,
}

impl Ring {
    /// With room for so many bytes of segments.
    pub(super) fn new(memory: u64) -> Self {
        Self { memory, ..Self::default() }
    }

    /// A component, by its hash; true when it is new.
    pub(super) fn add_component(&mut self, hash: &str, chunk: Vec<u8>) -> bool {
        self.components.insert(hash.into(), chunk).is_none()
    }

    /// A segment of a component; the oldest ones go, so that all of it and `open` bytes stay within the memory.
    pub(super) fn add(&mut self, hash: String, chunk: Vec<u8>, open: usize) {
        self.bytes += chunk.len() as u64;
        self.segments.push_back((hash, chunk));
        while self.bytes + open as u64 > self.memory
            && let Some((_, oldest)) = self.segments.pop_front()
        {
            self.bytes -= oldest.len() as u64;
        }
    }

    /// As one file, with the components that its segments need.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let needed: BTreeSet<_> = self.segments.iter().map(|(hash, _)| hash).collect();
        let mut file = header();
        needed.into_iter().filter_map(|hash| self.components.get(hash)).for_each(|c| file.extend_from_slice(c));
        self.segments.iter().for_each(|(_, chunk)| file.extend_from_slice(chunk));
        file
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_never_holds_more_than_its_memory_and_keeps_the_newest() {
        let mut ring = Ring::new(1000);
        for n in 0..100u8 {
            ring.add("c".into(), vec![n; 90], 50);
            assert!(ring.bytes + 50 <= 1000);
            assert_eq!(ring.bytes, ring.segments.iter().map(|(_, s)| s.len() as u64).sum::<u64>());
        }
        let kept: Vec<_> = ring.segments.iter().map(|(_, s)| s[0]).collect();
        assert_eq!(kept, (90..100).collect::<Vec<u8>>());
    }
}
