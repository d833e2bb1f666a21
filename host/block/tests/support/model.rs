//! What a good guest must answer, computed here: the third opinion beside the two call paths.

use super::class::{Leaf, Spec, Ty};
use latchwork_block::Scan;

const K: u64 = 0x9e37_79b9_7f4a_7c15;

/// The state of a generated guest.
#[derive(Clone)]
pub struct Model {
    spec: Spec,
    settings: Vec<u64>,
    state: Vec<u64>,
    count: u64,
    posts: u64,
    reallocs: u64,
}

impl Model {
    pub fn new(spec: &Spec) -> Self {
        let settings = vec![0; spec.setting_leaves().len()];
        let state = vec![0; spec.retained_leaves().len()];
        Self { spec: spec.clone(), settings, state, count: 0, posts: 0, reallocs: 0 }
    }

    fn called(&mut self, flat_params: usize) {
        self.reallocs += u64::from(flat_params > 16);
    }

    fn returned(&mut self) {
        self.posts += u64::from(self.spec.post_return);
    }

    /// Result cells of an execution.
    pub fn execute(&mut self, scan: Scan, arguments: &[u64]) -> Vec<u64> {
        let mut params = vec![scan.now, scan.elapsed, scan.first.into()];
        params.extend_from_slice(arguments);
        self.called(params.len());
        let mut h = 0x517c_c1b7_2722_0a95;
        let mut words = Vec::new();
        if self.state.is_empty() {
            words.extend([self.count, self.posts, self.reallocs]);
        }
        for word in words.iter().chain(&self.state).chain(&self.settings).chain(&params) {
            h = mix(h, *word);
        }
        let sig = self.spec.execute();
        let types: Vec<Leaf> = sig.params.iter().flat_map(Ty::leaves).collect();
        for (j, leaf) in self.spec.retained_leaves().into_iter().enumerate() {
            self.state[j] = leaf.normal(derived(h, j as u32 + 100));
        }
        self.count += 1;
        self.returned();
        let results = self.spec.result_leaves();
        results
            .iter()
            .enumerate()
            .map(|(j, leaf)| {
                let same = types.iter().rposition(|t| t == leaf).filter(|_| matches!(leaf, Leaf::F32 | Leaf::F64));
                match same {
                    Some(k) if h & 1 == 1 => params[k],
                    _ => leaf.normal(derived(h, j as u32)),
                }
            })
            .collect()
    }

    /// The guest takes these settings.
    pub fn configure(&mut self, settings: &[u64]) -> bool {
        self.called(settings.len());
        self.returned();
        let h = settings.iter().fold(1, |h, word| mix(h, *word));
        let taken = !(self.spec.refuses && h & 3 == 0);
        if taken {
            self.settings = settings.to_vec();
        }
        taken
    }

    pub fn defaults(&mut self) -> Option<Vec<u64>> {
        if !self.spec.defaults || self.settings.is_empty() {
            return None;
        }
        self.returned();
        let value = |(j, leaf): (usize, Leaf)| leaf.normal(0x0123_4567_89ab_cdefu64.rotate_left(5 * j as u32));
        Some(self.spec.setting_leaves().into_iter().enumerate().map(value).collect())
    }

    pub fn save(&mut self) -> Option<Vec<u64>> {
        if self.state.is_empty() {
            return None;
        }
        self.returned();
        Some(self.state.clone())
    }

    pub fn restore(&mut self, state: &[u64]) {
        if !self.state.is_empty() {
            self.called(state.len());
            self.state = state.to_vec();
        }
    }
}

fn mix(h: u64, word: u64) -> u64 {
    let h = (h.rotate_left(23) ^ word).wrapping_mul(K);
    h ^ (h >> 29)
}

fn derived(h: u64, j: u32) -> u64 {
    let odd = 0xd6e8_feb8_6659_fd93u64.wrapping_mul(2 * u64::from(j) + 1);
    h.wrapping_mul(odd).rotate_left(7 * j % 64)
}
