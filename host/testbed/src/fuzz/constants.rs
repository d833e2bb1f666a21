//! Constants in the code of a component. What a block compares its inputs with stands there: values worth trying.

use std::collections::BTreeSet;
use wasmparser::{Operator, Parser, Payload};

/// Most constants of a kind; a runtime of a large language has many, which say nothing of the block.
const MOST: usize = 4096;

/// Distinct constants, in their order.
#[derive(Debug, Default)]
pub(super) struct Constants {
    /// Of whole numbers, sign-extended.
    pub(super) integers: Vec<i64>,
    /// Of reals.
    pub(super) reals: Vec<f64>,
}

impl Constants {
    /// Those of all core modules of a component. What cannot be read has none.
    pub(super) fn of(component: &[u8]) -> Self {
        let (mut integers, mut reals) = (BTreeSet::new(), BTreeSet::new());
        for payload in Parser::new(0).parse_all(component) {
            let Ok(payload) = payload else { break };
            let Payload::CodeSectionEntry(body) = payload else { continue };
            let Ok(mut operators) = body.get_operators_reader() else { continue };
            while let Ok(operator) = operators.read() {
                let real = |r: f64| r.to_bits();
                let _ = match operator {
                    Operator::I32Const { value } => integers.insert(value.into()),
                    Operator::I64Const { value } => integers.insert(value),
                    Operator::F32Const { value } => reals.insert(real(f32::from_bits(value.bits()).into())),
                    Operator::F64Const { value } => reals.insert(value.bits()),
                    _ => false,
                };
            }
            if integers.len() + reals.len() > MOST {
                break;
            }
        }
        Self { integers: integers.into_iter().collect(), reals: reals.into_iter().map(f64::from_bits).collect() }
    }
}
