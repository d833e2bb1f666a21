//! Random classes and random values for property tests.

use super::class::{Leaf, Spec, Ty};
use proptest::prelude::*;

fn leaf() -> impl Strategy<Value = Leaf> {
    prop_oneof![
        Just(Leaf::Bool),
        Just(Leaf::U8),
        Just(Leaf::U16),
        Just(Leaf::U32),
        Just(Leaf::U64),
        Just(Leaf::S8),
        Just(Leaf::S16),
        Just(Leaf::S32),
        Just(Leaf::S64),
        Just(Leaf::F32),
        Just(Leaf::F64),
        prop_oneof![1..=9u16, Just(256), Just(257)].prop_map(Leaf::Enum),
        prop_oneof![1..=10u8, Just(16), Just(17), Just(32)].prop_map(Leaf::Flags),
    ]
}

fn ty() -> impl Strategy<Value = Ty> {
    let flat = prop_oneof![
        8 => leaf().prop_map(Ty::Leaf),
        1 => Just(Ty::Duration),
        1 => Just(Ty::RealSignal),
        1 => Just(Ty::BoolSignal),
    ];
    flat.prop_recursive(2, 8, 3, |inner| prop::collection::vec(inner, 1..4).prop_map(Ty::Record))
}

fn fields(from: usize, to: usize) -> impl Strategy<Value = Vec<Ty>> {
    prop::collection::vec(ty(), from..=to)
}

/// Any class the contract allows. Half of them have few inputs, half so many that they no longer fit into flat
/// parameters.
pub fn spec() -> impl Strategy<Value = Spec> {
    let part = || prop_oneof![Just(Vec::new()), fields(1, 4), fields(12, 20)];
    let outputs = prop_oneof![1 => fields(1, 1), 3 => fields(1, 8)];
    let flags = || prop_oneof![Just(0u8), 1..=9u8, Just(17), Just(32)];
    (
        prop_oneof![Just(Vec::new()), fields(1, 6), fields(12, 20)],
        outputs,
        part(),
        flags(),
        flags(),
        part(),
        any::<(bool, bool, bool, bool)>(),
    )
        .prop_map(
            |(inputs, outputs, settings, commands, alarms, retained, (defaults, log, post_return, refuses))| Spec {
                inputs,
                outputs,
                settings,
                commands,
                alarms,
                retained,
                defaults,
                log,
                post_return,
                refuses,
            },
        )
}

/// A stream of cells out of one seed; which type a cell has is known only once the class is.
pub struct Cells(u64);

impl Cells {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        // splitmix64
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn of(&mut self, leaves: &[Leaf]) -> Vec<u64> {
        leaves.iter().map(|leaf| leaf.value(self.bits())).collect()
    }
}

/// Configuration of the property tests: a failure prints its smallest case, which then becomes a test with a name.
pub fn config(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, max_shrink_iters: 200, ..ProptestConfig::default() }
}
