//! The generator of guests makes components: checked here alone, so that a failure elsewhere is not its fault.

mod support;

use proptest::prelude::*;
use support::class::{Leaf, Spec, Ty};
use support::component::generated;
use support::evil::{Evil, When};
use support::strategy;

proptest! {
    #![proptest_config(strategy::config(64))]

    #[test]
    fn every_class_can_be_encoded(spec in strategy::spec()) {
        let bytes = generated(&spec, Evil::None, When(0));
        wasmparser::Validator::new().validate_all(&bytes).unwrap();
    }
}

#[test]
fn every_hostile_guest_can_be_encoded() {
    let all = Spec {
        inputs: vec![Ty::RealSignal; 8],
        outputs: vec![Ty::Leaf(Leaf::Bool), Ty::Leaf(Leaf::Enum(3)), Ty::Leaf(Leaf::Flags(3)), Ty::Leaf(Leaf::F32)],
        alarms: 3,
        post_return: true,
        ..Spec::default()
    };
    for evil in support::evil::ALL {
        let bytes = generated(&all, *evil, When(3));
        wasmparser::Validator::new().validate_all(&bytes).unwrap_or_else(|e| panic!("{evil:?}: {e}"));
    }
}

#[test]
fn layout_is_that_of_the_canonical_abi() {
    let ty = Ty::Record(vec![
        Ty::Leaf(Leaf::Bool),
        Ty::RealSignal,
        Ty::Leaf(Leaf::U8),
        Ty::Record(vec![Ty::Leaf(Leaf::U16), Ty::Leaf(Leaf::S8)]),
        Ty::Leaf(Leaf::Flags(17)),
    ]);
    let mut leaves = Vec::new();
    assert_eq!(ty.layout(0, &mut leaves), (40, 8));
    let offsets: Vec<u32> = leaves.iter().map(|(_, at)| *at).collect();
    assert_eq!(offsets, [0, 8, 16, 24, 26, 28, 32]);
}
