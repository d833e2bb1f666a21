//! Damaged components: whatever the bytes are, loading answers; it never panics, hangs or runs what it should not.

mod support;

use latchwork_block::{CallPath, Limits, Scan};
use proptest::prelude::*;
use std::sync::LazyLock;
use support::class::{Leaf, Spec, Ty};
use support::component::generated;
use support::evil::{Evil, When};
use support::strategy;
use support::twins::engine;

/// A good component with every part a class can have.
fn good() -> &'static [u8] {
    static GOOD: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let spec = Spec {
            inputs: vec![Ty::RealSignal, Ty::Leaf(Leaf::Enum(5)), Ty::Record(vec![Ty::Leaf(Leaf::S8), Ty::Duration])],
            outputs: vec![Ty::Leaf(Leaf::Bool), Ty::BoolSignal, Ty::Leaf(Leaf::Flags(9))],
            settings: vec![Ty::Duration],
            commands: 3,
            alarms: 2,
            retained: vec![Ty::Leaf(Leaf::U32), Ty::Leaf(Leaf::F64)],
            defaults: true,
            log: true,
            post_return: true,
            refuses: false,
        };
        generated(&spec, Evil::None, When(0))
    });
    &GOOD
}

/// Loads, and if that is possible instantiates and calls everything once. The answers do not matter here.
fn use_it(bytes: &[u8]) -> Result<(), String> {
    let component = engine(None).load_bytes("damaged", bytes).map_err(|e| e.to_string())?;
    for class in component.classes() {
        // A table of names may have been hit: a class of any shape must be usable.
        for path in [None, Some(CallPath::Component)] {
            let component = engine(path).load_bytes("damaged", bytes).map_err(|e| e.to_string())?;
            let class = component.class(Some(&class.name)).map_err(|e| e.to_string())?;
            let template = component.template(&class).map_err(|e| e.to_string())?;
            let limits = Limits { budget_ticks: 2, ..Limits::default() };
            let mut instance = template.instantiate(&limits).map_err(|e| e.to_string())?;
            let (n, m) = (class.argument_cells(), class.output_cells());
            let mut cells = vec![0; n + m];
            let ins: Vec<u32> = (0..n as u32).collect();
            let scan = Scan { now: 1, elapsed: 0, first: true };
            let _ = instance.configure(&vec![0; class.settings.len()]);
            let _ = instance.execute(scan, &ins, n as u32, &mut cells);
            let _ = instance.defaults();
            if let Ok(Some(state)) = instance.save() {
                let _ = instance.restore(&state);
            }
        }
    }
    Ok(())
}

#[test]
fn the_good_one_is_good() {
    use_it(good()).unwrap();
}

/// A file that was cut anywhere is refused; only whole sections of no meaning (names, producers) may be missing.
#[test]
fn cut_anywhere() {
    let good = good();
    for length in 0..good.len() {
        let _ = use_it(&good[..length]);
    }
    for length in 0..good.len() / 2 {
        use_it(&good[..length]).expect_err("half a component was accepted");
    }
}

proptest! {
    #![proptest_config(strategy::config(400))]

    #[test]
    fn flipped_bits(flips in prop::collection::vec((any::<prop::sample::Index>(), 0..8u8), 1..6)) {
        let mut bytes = good().to_vec();
        for (index, bit) in flips {
            let at = index.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        let _ = use_it(&bytes);
    }

    #[test]
    fn changed_bytes(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = good().to_vec();
        for (index, value) in changes {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        let _ = use_it(&bytes);
    }

    #[test]
    fn a_part_moved(from: prop::sample::Index, to: prop::sample::Index, length in 1..64usize) {
        let mut bytes = good().to_vec();
        let from = from.index(bytes.len());
        let part: Vec<u8> = bytes.drain(from..(from + length).min(good().len())).collect();
        let to = to.index(bytes.len() + 1);
        bytes.splice(to..to, part);
        let _ = use_it(&bytes);
    }

    #[test]
    fn random_bytes(mut bytes in prop::collection::vec(any::<u8>(), 0..400), header in 0..3u8) {
        let magic: &[u8] = match header {
            0 => b"",
            1 => b"\0asm\x0d\0\x01\0",
            _ => b"\0asm\x01\0\0\0",
        };
        bytes.splice(0..0, magic.iter().copied());
        prop_assume!(bytes != b"\0asm\x0d\0\x01\0");
        prop_assert!(use_it(&bytes).is_err());
    }
}
