//! The ring in memory.

use latchwork_testbed::replay::header;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Segments as they stand in a file, the oldest first, and the components they need.
#[derive(Default)]
pub(super) struct Ring {
    memory: u64,
    segments: VecDeque<(String, Vec<u8>)>,
    bytes: u64,
    components: BTreeMap<String, Kept>,
}

/// A component.
struct Kept {
    chunk: Vec<u8>,
    /// Segments that need it.
    segments: u64,
    /// More of them may come.
    in_use: bool,
}

impl Ring {
    /// With room for so many bytes of segments.
    pub(super) fn new(memory: u64) -> Self {
        Self { memory, ..Self::default() }
    }

    /// A component that is in use from now on, by its hash.
    pub(super) fn add_component(&mut self, hash: &str, chunk: impl FnOnce() -> Vec<u8>) {
        let kept =
            self.components.entry(hash.into()).or_insert_with(|| Kept { chunk: chunk(), segments: 0, in_use: true });
        kept.in_use = true;
    }

    /// Those that are in use; of the others those go that no segment needs.
    pub(super) fn in_use(&mut self, hashes: &BTreeSet<String>) {
        self.components.retain(|hash, kept| {
            kept.in_use = hashes.contains(hash);
            kept.in_use || kept.segments > 0
        });
    }

    /// A segment of a component; the oldest ones go for it.
    pub(super) fn add(&mut self, hash: String, chunk: Vec<u8>) {
        self.bytes += chunk.len() as u64;
        if let Some(component) = self.components.get_mut(&hash) {
            component.segments += 1;
        }
        self.segments.push_back((hash, chunk));
        while self.bytes > self.memory
            && let Some((hash, oldest)) = self.segments.pop_front()
        {
            self.bytes -= oldest.len() as u64;
            self.let_go(&hash);
        }
    }

    /// A segment of a component is gone.
    fn let_go(&mut self, hash: &str) {
        let Some(component) = self.components.get_mut(hash) else { return };
        component.segments = component.segments.saturating_sub(1);
        if component.segments == 0 && !component.in_use {
            self.components.remove(hash);
        }
    }

    /// As one file, followed by what is not cut yet, with the components that all of it needs.
    pub(super) fn to_bytes(&self, open: impl Iterator<Item = (String, Vec<u8>)>) -> Vec<u8> {
        let open: Vec<_> = open.collect();
        let needed: BTreeSet<_> = self.segments.iter().chain(&open).map(|(hash, _)| hash).collect();
        let mut file = header();
        needed.into_iter().filter_map(|hash| self.components.get(hash)).for_each(|c| file.extend_from_slice(&c.chunk));
        self.segments.iter().chain(&open).for_each(|(_, chunk)| file.extend_from_slice(chunk));
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
            ring.add("c".into(), vec![n; 95]);
            assert!(ring.bytes <= 1000);
            assert_eq!(ring.bytes, ring.segments.iter().map(|(_, s)| s.len() as u64).sum::<u64>());
        }
        let kept: Vec<_> = ring.segments.iter().map(|(_, s)| s[0]).collect();
        assert_eq!(kept, (90..100).collect::<Vec<u8>>());
    }

    #[test]
    fn a_component_goes_with_the_last_segment_that_needs_it_unless_more_may_come() {
        let mut ring = Ring::new(1000);
        let only = |hash: &str| BTreeSet::from([hash.to_owned()]);
        for version in 0..50 {
            let hash = version.to_string();
            ring.add_component(&hash, || vec![0; 10]);
            ring.in_use(&only(&hash));
            (0..3).for_each(|_| ring.add(hash.clone(), vec![0; 95]));
            let needed: BTreeSet<_> = ring.segments.iter().map(|(hash, _)| hash).collect();
            assert!(ring.components.keys().eq(needed), "{version}");
        }
        // One in use stays without any segment.
        ring.add_component("rests", || vec![0; 10]);
        (0..20).for_each(|_| ring.add("49".into(), vec![0; 95]));
        assert!(ring.components.keys().eq(["49", "rests"]));
        ring.in_use(&only("49"));
        assert!(ring.components.keys().eq(["49"]));
    }
}
