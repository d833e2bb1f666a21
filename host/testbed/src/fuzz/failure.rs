//! Where and how a sequence went wrong.

use super::report::Kind;
use super::values::real;
use latchwork_block::{Fault, FaultKind};
use latchwork_image::Type;

/// Where and how a sequence went wrong.
#[derive(Clone, Debug)]
pub(super) struct Failure {
    pub(super) kind: Kind,
    pub(super) message: String,
    /// Step and execution of the step; `None`: before the first.
    pub(super) place: Option<(usize, u32)>,
    /// Output cells as they should be and as they were; nothing after a fault.
    pub(super) expected: Vec<u64>,
    pub(super) got: Vec<u64>,
}

/// Zeros are equal whatever their sign, and so is all that is no number: nothing that a plant sees.
pub(super) fn equal(ty: &Option<Type>, a: u64, b: u64) -> bool {
    a == b
        || ty.as_ref().is_some_and(|ty| {
            let (a, b) = (real(ty, a), real(ty, b));
            a == b || (a.is_nan() && b.is_nan())
        })
}

/// The same for the cells of ports without quality.
pub(super) fn same_cells(ports: &[latchwork_block::Port], a: &[u64], b: &[u64]) -> bool {
    let real = |ty: &Type| Some(ty.clone()).filter(|ty| matches!(ty, Type::F32 | Type::F64));
    ports.iter().zip(a.iter().zip(b)).all(|(port, (a, b))| equal(&real(&port.ty), *a, *b))
}

/// A fault as a failure.
pub(super) fn fault(fault: &Fault, place: Option<(usize, u32)>, before: &str) -> Failure {
    let kind = if fault.kind == FaultKind::Budget { Kind::Budget } else { Kind::Fault(fault.kind) };
    Failure { kind, message: format!("{before}{fault}"), place, expected: Vec::new(), got: Vec::new() }
}

/// Two instances that differ.
pub(super) fn different(kind: Kind, message: &str, place: Option<(usize, u32)>) -> Failure {
    Failure { kind, message: message.into(), place, expected: Vec::new(), got: Vec::new() }
}
