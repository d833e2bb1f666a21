//! The faults, so that no optimizer can take them away.

use core::hint::black_box;
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};
use latchwork_sdk::log::{self, Level};

/// Log messages of one flood.
const FLOOD: u32 = 5_000;
/// An enum of two cases has none of this number.
const NO_CASE: u8 = 7;
/// Neither false nor true.
const NO_BOOL: u8 = 0xfe;

/// The outputs to spoil when the bindings have written them.
static BAD_ENUM: AtomicBool = AtomicBool::new(false);
static BAD_BOOL: AtomicBool = AtomicBool::new(false);

unsafe extern "C" {
    /// `a / b` without a check; made by build.rs.
    safe fn stress_divide(a: u32, b: u32) -> u32;
}

/// Executes `unreachable`.
pub(crate) fn trap() -> ! {
    core::arch::wasm32::unreachable()
}

/// Divides an integer by zero.
pub(crate) fn divide_by_zero() {
    black_box(stress_divide(1, 0));
}

/// Never returns.
pub(crate) fn endless_loop() -> ! {
    loop {
        black_box(0);
    }
}

/// Takes memory page by page until it is refused, then traps.
pub(crate) fn grow_memory() -> ! {
    const REFUSED: usize = usize::MAX;
    while core::arch::wasm32::memory_grow::<0>(1) != REFUSED {}
    trap()
}

/// Calls itself until the stack is full. Through a volatile pointer no optimizer sees the loop this is, and the frames stay
/// off the small stack in linear memory: it is the host's guard that must stop it.
pub(crate) fn recurse() {
    static NEXT: fn(u32) -> u32 = deeper;
    #[inline(never)]
    fn deeper(depth: u32) -> u32 {
        // SAFETY: reads a static of that very type, which nobody writes.
        let next = unsafe { core::ptr::read_volatile(&raw const NEXT) };
        next(depth.wrapping_add(1)).wrapping_add(depth)
    }
    black_box(deeper(0));
}

/// Writes thousands of messages.
pub(crate) fn flood_log() {
    for _ in 0..FLOOD {
        log::write(Level::Warning, "flood: this block was asked to flood the log");
    }
}

/// Divides 64-bit integers `rounds` times, some 10 ns each, each needing the one before.
pub(crate) fn burn(rounds: u32) {
    let (mut x, divisor) = (u64::MAX, black_box(3));
    for _ in 0..rounds {
        x = !(x / divisor) / divisor;
    }
    black_box(x);
}

/// Asks for illegal outputs of this execution.
pub(crate) fn spoil(bad_enum: bool, bad_bool: bool) {
    BAD_ENUM.store(bad_enum, Relaxed);
    BAD_BOOL.store(bad_bool, Relaxed);
}

/// The byte to write for `mode`, if it is to be illegal.
pub(crate) fn bad_enum() -> Option<u8> {
    BAD_ENUM.load(Relaxed).then_some(NO_CASE)
}

/// The byte to write for `alive`, if it is to be illegal.
pub(crate) fn bad_bool() -> Option<u8> {
    BAD_BOOL.load(Relaxed).then_some(NO_BOOL)
}
