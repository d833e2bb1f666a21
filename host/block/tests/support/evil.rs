//! What a hostile guest does, as WebAssembly text that the generator splices in.

use super::class::{Flat, Leaf};
use super::guest::{RESULT, store};

/// The number of good executions before the guest misbehaves.
#[derive(Clone, Copy, Debug)]
pub struct When(pub u64);

/// How a guest misbehaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Evil {
    None,
    /// The first bool result has this byte.
    Bool(u8),
    /// The first enum result has all bits set.
    EnumOnes,
    /// The first enum result is the number of its cases: one too much.
    EnumPast,
    /// All flags results have all bits set.
    FlagBits,
    /// All reals are signalling NaNs.
    SignallingNan,
    /// The result's address is this much beyond where it should be.
    PointerOff(u32),
    /// The result's address.
    Pointer(u32),
    /// The last byte of the result is the last one, or the first beyond the end of memory.
    PointerAtEnd {
        beyond: bool,
    },
    Trap,
    TrapInPost,
    TrapInRealloc,
    TrapInSave,
    /// `cabi_realloc` returns this address.
    Realloc(u32),
    /// Memory grows by a page and the result stands in it.
    Grow,
    LogInRealloc,
    LogInPost,
    /// `log.write` with this address and length.
    LogString(u32, u32),
    LogInvalidUtf8,
    LogBadLevel,
    /// One message of this many bytes, zeros; the guest has memory for it.
    LogLong(u32),
    /// `configure` refuses everything with a sentence of this many bytes, zeros; the guest has memory for it.
    RefuseLong(u32),
    /// `configure` answers what is no `result<_, string>`.
    Answer(Answer),
    /// This many messages in one execution.
    LogFlood(u32),
    /// So many messages that one more is dropped; that one is no text, outside of memory, or of no level.
    LogFloodThen(Last),
    DivideByZero,
    Loop,
    Recurse,
    /// Grows memory until refused, then traps.
    GrowForEver,
    /// Grows memory until refused, then goes on as if nothing had happened.
    GrowUntilRefused,
    /// As `GrowUntilRefused` in one execution, a trap in the one after.
    GrowThenTrap,
    /// The module's start function.
    StartTraps,
    StartLoops,
    StartLogs,
    /// A data segment that does not fit.
    DataOutside,
    /// Initial memory, pages.
    Pages(u32),
    /// A second memory.
    TwoMemories,
}

/// The message after a flood.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Last {
    InvalidUtf8,
    Outside,
    BadLevel,
}

/// An answer of `configure` that is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Neither ok nor error.
    Discriminant(u8),
    /// A sentence that ends outside of memory.
    Outside,
    /// A sentence whose end wraps around.
    Wraps,
    InvalidUtf8,
    /// The address of the answer.
    At(u32),
}

impl Evil {
    pub fn logs(self) -> bool {
        matches!(
            self,
            Self::LogInRealloc
                | Self::LogInPost
                | Self::LogString(..)
                | Self::LogInvalidUtf8
                | Self::LogBadLevel
                | Self::LogLong(_)
                | Self::StartLogs
                | Self::LogFlood(_)
                | Self::LogFloodThen(_)
        )
    }

    pub fn pages(self) -> u32 {
        match self {
            Self::Pages(n) => n,
            Self::LogLong(n) | Self::RefuseLong(n) => 2 + n / 65536,
            _ => 1,
        }
    }

    pub fn memories(self) -> u32 {
        u32::from(self == Self::TwoMemories)
    }

    pub fn globals(self) -> &'static str {
        match self {
            Self::Recurse => {
                "(func $recurse (param i64) (result i64) (i64.add (call $recurse (local.get 0)) (i64.const 1)))"
            }
            Self::DataOutside => "(data (memory $m) (i32.const 65535) \"xx\")",
            _ => "",
        }
    }

    pub fn start(self) -> &'static str {
        match self {
            Self::StartTraps => "(func $start unreachable)(start $start)",
            Self::StartLoops => "(func $start (loop $l (br $l)))(start $start)",
            Self::StartLogs => "(func $start (call $log (i32.const 1) (i32.const 1024) (i32.const 2)))(start $start)",
            _ => "",
        }
    }

    fn due(then: &str) -> String {
        format!("(if (call $due) (then {then}))\n")
    }

    pub fn in_execute(self) -> String {
        match self {
            Self::Trap => Self::due("unreachable"),
            Self::DivideByZero => Self::due("(drop (i64.div_u (i64.const 1) (i64.and (global.get $h) (i64.const 0))))"),
            Self::Loop => Self::due("(loop $l (br $l))"),
            Self::Recurse => Self::due("(drop (call $recurse (global.get $h)))"),
            Self::GrowThenTrap => {
                let grow = Self::GrowUntilRefused.in_execute();
                let again = "(i64.store (i32.const 2048) (i64.add (i64.load (i32.const 2048)) (i64.const 1)))";
                let trap = Self::due(&format!(
                    "{again} (if (i64.gt_u (i64.load (i32.const 2048)) (i64.const 1)) (then unreachable))"
                ));
                trap + &grow
            }
            Self::GrowForEver => Self::due(
                "(loop $l (if (i32.eq (memory.grow $m (i32.const 1)) (i32.const -1)) (then unreachable)) (br $l))",
            ),
            Self::GrowUntilRefused => {
                Self::due("(loop $l (br_if $l (i32.ne (memory.grow $m (i32.const 1)) (i32.const -1))))")
            }
            Self::Grow => Self::due("(drop (memory.grow $m (i32.const 1)))"),
            Self::LogString(at, len) => {
                Self::due(&format!("(call $log (i32.const 1) (i32.const {at}) (i32.const {len}))"))
            }
            Self::LogLong(len) => Self::due(&format!("(call $log (i32.const 1) (i32.const 65536) (i32.const {len}))")),
            Self::LogInvalidUtf8 => Self::due(
                "(i32.store (i32.const 2048) (i32.const 0x41fffe41)) (call $log (i32.const 1) (i32.const 2048) (i32.const 4))",
            ),
            Self::LogBadLevel => Self::due("(call $log (i32.const 4) (i32.const 1024) (i32.const 2))"),
            Self::LogFloodThen(last) => {
                let last = match last {
                    Last::InvalidUtf8 => Self::LogInvalidUtf8,
                    Last::Outside => Self::LogString(65535, 2),
                    Last::BadLevel => Self::LogBadLevel,
                };
                Self::LogFlood(1000).in_execute() + &last.in_execute()
            }
            Self::LogFlood(n) => Self::due(&format!(
                "(i32.store (i32.const 2048) (i32.const {n})) (loop $l (call $log (i32.const 2) (i32.const 1024) (i32.const 8)) \
                 (i32.store (i32.const 2048) (i32.sub (i32.load (i32.const 2048)) (i32.const 1))) \
                 (br_if $l (i32.load (i32.const 2048))))"
            )),
            _ => String::new(),
        }
    }

    /// The last of `configure`: its result, which stands at `RESULT`.
    pub fn answer(self) -> String {
        let good = format!("(i32.const {RESULT})");
        let refusal = |at: u32, len: u32| {
            format!(
                "(i32.store8 (i32.const {RESULT}) (i32.const 1)) (i32.store (i32.const {}) (i32.const {at})) \
                 (i32.store (i32.const {}) (i32.const {len})) {good}",
                RESULT + 4,
                RESULT + 8
            )
        };
        let Self::Answer(answer) = self else { return good };
        match answer {
            Answer::Discriminant(d) => format!("(i32.store8 (i32.const {RESULT}) (i32.const {d})) {good}"),
            Answer::Outside => refusal(65530, 7),
            Answer::Wraps => refusal(0xffff_fff0, 0x20),
            Answer::InvalidUtf8 => format!("(i32.store8 (i32.const 2048) (i32.const 0xff)) {}", refusal(2048, 1)),
            Answer::At(p) => format!("(i32.const {p})"),
        }
    }

    pub fn in_save(self) -> &'static str {
        if self == Self::TrapInSave { "unreachable\n" } else { "" }
    }

    /// Runs before the execution is counted.
    pub fn in_realloc(self) -> String {
        let due = |then: &str| format!("(if (call $due-next) (then {then}))\n");
        match self {
            Self::TrapInRealloc => due("unreachable"),
            Self::Realloc(p) => due(&format!("(return (i32.const {p}))")),
            Self::LogInRealloc => due("(call $log (i32.const 1) (i32.const 1024) (i32.const 2))"),
            _ => String::new(),
        }
    }

    pub fn in_post(self) -> &'static str {
        match self {
            Self::TrapInPost => "(if (call $due) (then unreachable))",
            Self::LogInPost => "(if (call $due) (then (call $log (i32.const 1) (i32.const 1024) (i32.const 2))))",
            _ => "",
        }
    }

    /// The only result, flat.
    pub fn flat_result(self, leaf: Leaf, good: &str) -> String {
        let bad = match (self, leaf) {
            (Self::Bool(b), Leaf::Bool) => format!("(i32.const {b})"),
            (Self::EnumOnes, Leaf::Enum(_)) | (Self::FlagBits, Leaf::Flags(_)) => "(i32.const -1)".into(),
            (Self::EnumPast, Leaf::Enum(n)) => format!("(i32.const {n})"),
            (Self::SignallingNan, Leaf::F32) => "(f32.reinterpret_i32 (i32.const 0x7f800001))".into(),
            (Self::SignallingNan, Leaf::F64) => "(f64.reinterpret_i64 (i64.const 0x7ff0000000000001))".into(),
            // Narrow integers with garbage above: the host takes the low bits alone.
            (Self::FlagBits, l) if l.flat() == Flat::I32 && l.size() < 4 && l != Leaf::Bool => {
                format!("(i32.or {good} (i32.const 0x5a000000))")
            }
            _ => return good.into(),
        };
        format!("(if (result {}) (call $due) (then {bad}) (else {good}))", leaf.flat().name())
    }

    /// Spoils results in memory.
    pub fn in_memory(self, leaves: &[(Leaf, u32)]) -> String {
        let first = |is: fn(Leaf) -> bool| leaves.iter().copied().find(|(l, _)| is(*l));
        let set = |(leaf, at): (Leaf, u32), bits: i64| store(leaf, at, &format!("(i64.const {bits})"));
        let text = match self {
            Self::Bool(b) => first(|l| l == Leaf::Bool).map(|l| set(l, b.into())),
            Self::EnumOnes => first(|l| matches!(l, Leaf::Enum(_))).map(|l| set(l, -1)),
            Self::EnumPast => first(|l| matches!(l, Leaf::Enum(_))).map(|l| {
                let Leaf::Enum(n) = l.0 else { unreachable!() };
                set(l, n.into())
            }),
            Self::FlagBits => {
                Some(leaves.iter().filter(|(l, _)| matches!(l, Leaf::Flags(_))).map(|l| set(*l, -1)).collect())
            }
            Self::SignallingNan => Some(
                leaves
                    .iter()
                    .filter_map(|l| match l.0 {
                        Leaf::F32 => Some(set(*l, 0xff80_0001)),
                        Leaf::F64 => Some(set(*l, 0x7ff0_0000_0000_0001)),
                        _ => None,
                    })
                    .collect(),
            ),
            _ => None,
        };
        text.map(|t| Self::due(&t)).unwrap_or_default()
    }

    /// The address of results in memory.
    pub fn pointer(self, size: u32) -> String {
        let bad = match self {
            Self::PointerOff(n) => RESULT + n,
            Self::Pointer(p) => p,
            Self::PointerAtEnd { beyond: false } => (65536 - size) & !7,
            Self::PointerAtEnd { beyond: true } => (65536 - size + 8) & !7,
            Self::Grow => {
                // The new page holds a copy of the results.
                let copy = format!("(memory.copy (i32.const 65536) (i32.const {RESULT}) (i32.const {size}))");
                return format!(
                    "(if (result i32) (call $due) (then {copy} (i32.const 65536)) (else (i32.const {RESULT})))"
                );
            }
            _ => return format!("(i32.const {RESULT})"),
        };
        format!("(if (result i32) (call $due) (then (i32.const {bad})) (else (i32.const {RESULT})))")
    }
}

/// Everything a guest may do in `execute` that ends by itself.
pub const ALL: &[Evil] = &[
    Evil::None,
    Evil::Bool(2),
    Evil::Bool(0xfe),
    Evil::EnumOnes,
    Evil::EnumPast,
    Evil::FlagBits,
    Evil::SignallingNan,
    Evil::PointerOff(1),
    Evil::PointerOff(2),
    Evil::PointerOff(4),
    Evil::PointerOff(8),
    Evil::Pointer(0),
    Evil::Pointer(65536),
    Evil::Pointer(0x8000_0000),
    Evil::Pointer(0xffff_fff8),
    Evil::Pointer(0xffff_ffff),
    Evil::PointerAtEnd { beyond: false },
    Evil::PointerAtEnd { beyond: true },
    Evil::Trap,
    Evil::TrapInPost,
    Evil::TrapInRealloc,
    Evil::TrapInSave,
    Evil::Realloc(0),
    Evil::Realloc(1),
    Evil::Realloc(4),
    Evil::Realloc(65536),
    Evil::Realloc(65528),
    Evil::Realloc(0xffff_fff8),
    Evil::Realloc(0xffff_ffff),
    Evil::Grow,
    Evil::LogInRealloc,
    Evil::LogInPost,
    Evil::LogString(65535, 2),
    Evil::LogString(65536, 0),
    Evil::LogString(65537, 0),
    Evil::LogString(0xffff_ffff, 0xffff_ffff),
    Evil::LogString(0, 0xffff_ffff),
    Evil::LogInvalidUtf8,
    Evil::LogBadLevel,
    Evil::LogFlood(10_000),
    Evil::LogFloodThen(Last::InvalidUtf8),
    Evil::LogFloodThen(Last::Outside),
    Evil::LogFloodThen(Last::BadLevel),
    Evil::DivideByZero,
    Evil::Recurse,
    Evil::GrowForEver,
    Evil::GrowUntilRefused,
    Evil::GrowThenTrap,
];
