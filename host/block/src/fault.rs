//! What can go wrong in a block, and how the engine's errors are told.

use crate::interface::Function;
use crate::state::State;
use wasmtime::Trap;

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
    /// It handed the host what its interface does not allow.
    Result,
    /// It could not be instantiated.
    Instantiate,
    /// It refused its settings.
    Settings,
}

impl FaultKind {
    /// All of them, by their [`code`](Self::code).
    pub const ALL: [Self; 7] =
        [Self::Trap, Self::Budget, Self::Memory, Self::Stack, Self::Result, Self::Instantiate, Self::Settings];

    /// Its number, below 8: it never changes its meaning, recordings hold it.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The kind of a number.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

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

impl Fault {
    /// An error of the engine in a function of a class, or while instantiating.
    #[cold]
    pub(crate) fn new(function: Option<Function>, class: &str, error: &wasmtime::Error, state: &State) -> Self {
        let trap = error.downcast_ref::<Trap>();
        let kind = match trap {
            Some(Trap::Interrupt) => FaultKind::Budget,
            Some(Trap::StackOverflow) => FaultKind::Stack,
            _ if state.refused => FaultKind::Memory,
            Some(_) => FaultKind::Trap,
            None if function.is_some() => FaultKind::Result,
            None => FaultKind::Instantiate,
        };
        let place = match function {
            Some(f) => format!("{} of {class}", f.name()),
            None => format!("the start of {class}"),
        };
        let detail = match trap {
            Some(trap) => words(*trap),
            None => format!("{error:#}"),
        };
        let message = match kind {
            FaultKind::Budget => format!("{place} did not end within its budget of time"),
            FaultKind::Stack => format!("{place} recursed too deep: its stack is exhausted"),
            FaultKind::Memory => {
                format!("{place} wanted more memory than its limit of {}: {detail}", bytes(state.memory_limit()))
            }
            FaultKind::Result => format!("{place} handed over what its interface does not allow: {detail}"),
            FaultKind::Instantiate => format!("{place} failed: {detail}"),
            FaultKind::Trap | FaultKind::Settings => format!("{place} trapped: {detail}"),
        };
        Self { kind, message }
    }

    /// A call of an instance that has faulted before.
    #[cold]
    pub(crate) fn dead(function: Function, class: &str) -> Self {
        Self {
            kind: FaultKind::Trap,
            message: format!("{} of {class} was called after a fault; the instance is of no more use", function.name()),
        }
    }
}

/// A trap as an engineer reads it.
fn words(trap: Trap) -> String {
    match trap {
        Trap::UnreachableCodeReached => "unreachable code was reached (a panic or an abort)".into(),
        Trap::IntegerDivisionByZero => "division of an integer by zero".into(),
        Trap::IntegerOverflow => "overflow of an integer division".into(),
        Trap::BadConversionToInteger => "a real number that does not fit an integer was converted".into(),
        Trap::MemoryOutOfBounds => "access beyond its memory".into(),
        Trap::CannotLeaveComponent => "it called an import while it allocated or cleaned up for the host".into(),
        other => other.to_string().trim_start_matches("wasm trap: ").into(),
    }
}

/// A size with its unit.
fn bytes(n: usize) -> String {
    match n {
        n if n >= 1 << 20 && n.is_multiple_of(1 << 20) => format!("{} MiB", n >> 20),
        n if n >= 1 << 10 && n.is_multiple_of(1 << 10) => format!("{} KiB", n >> 10),
        n => format!("{n} bytes"),
    }
}
