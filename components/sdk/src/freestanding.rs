//! What `std` would bring to a `#![no_std]` block: an allocator and a panic handler, both as small as can be.
//!
//! The allocator first gives out what is left of the page that the stack and the statics lie in, so a block that
//! allocates a little (its log lines, more than 16 parameters) never grows its memory.

use core::alloc::Layout;
use core::arch::wasm32;
use talc::base::{Talc, binning::Binning};
use talc::{cell::TalcSyncCell, source::Source, wasm::WasmBinning};

/// Size of a wasm page, bytes.
const PAGE: usize = 64 * 1024;

#[global_allocator]
static ALLOCATOR: TalcSyncCell<Memory, WasmBinning> = TalcSyncCell::new_wasm(Memory { rest_taken: false });

/// The linear memory: its unused rest first, then new pages.
#[derive(Debug)]
struct Memory {
    rest_taken: bool,
}

// SAFETY: `acquire` neither allocates nor touches the allocator other than through `talc`.
unsafe impl Source for Memory {
    fn acquire<B: Binning>(talc: &mut Talc<Self, B>, layout: Layout) -> Result<(), ()> {
        let (base, size) = if talc.source.rest_taken {
            // The allocator's own tags and the alignment on top of what was asked for.
            let needed = layout.size().checked_add(layout.align()).and_then(|n| n.checked_add(256)).ok_or(())?;
            let pages = needed.div_ceil(PAGE);
            let end = wasm32::memory_grow::<0>(pages);
            if end == usize::MAX {
                return Err(());
            }
            (end * PAGE, pages * PAGE)
        } else {
            talc.source.rest_taken = true;
            let base = (&raw const __heap_base).addr();
            (base, wasm32::memory_size::<0>() * PAGE - base)
        };
        // SAFETY: nobody else uses this memory: it lies behind everything the linker placed, or it is new.
        // A rest that is too small is no error: the next call brings a page.
        let _ = unsafe { talc.claim(base as *mut u8, size) };
        Ok(())
    }
}

unsafe extern "C" {
    /// Set by the linker: the first byte behind stack and statics. Only its address means something.
    static __heap_base: u8;
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // A trap is all a host needs to know; carrying the message would cost more than most blocks.
    wasm32::unreachable()
}
