//! What can go wrong in a block.

/// Kind of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FaultKind {
    /// A WebAssembly trap: unreachable code, division by zero, access out of bounds, …
    Trap,
    /// It took longer than its budget.
    Budget,
    /// It wanted more memory than its limit.
    Memory,
    /// It recursed too deep.
    Stack,
    /// It returned what its interface does not allow.
    Result,
    /// It could not be instantiated.
    Instantiate,
    /// It refused its settings.
    Settings,
}

impl FaultKind {
    /// Name in records: `trap`, `budget`, `memory`, `stack`, `result`, `instantiate`, `settings`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trap => "trap",
            Self::Budget => "budget",
            Self::Memory => "memory",
            Self::Stack => "stack",
            Self::Result => "result",
            Self::Instantiate => "instantiate",
            Self::Settings => "settings",
        }
    }
}

/// A fault of a block. The instance that it happened in is of no more use.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Fault {
    /// Kind.
    pub kind: FaultKind,
    /// What happened where, in a sentence.
    pub message: String,
}
