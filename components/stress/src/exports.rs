//! The exports of the component, by hand: the names of the canonical ABI and the bindings' own adapters behind them.

use crate::block::Stress;
use crate::faults;

#[allow(warnings, reason = "written by wit-bindgen")]
mod generated {
    wit_bindgen::generate!({
        inline: "package latchwork:sdk-stress; world stress { export latchwork:device/stress@0.1.0; }",
        path: "../../wit/device",
        generate_all,
    });
}
pub(crate) use generated::exports::latchwork::device::stress as bindings;

/// Where `execute` returns its outputs: `executions` at 0, `value` at 8, `mode` at 16, `alive` at 17.
const MODE: usize = 16;
const ALIVE: usize = 17;

#[unsafe(export_name = "latchwork:device/stress@0.1.0#defaults")]
unsafe extern "C" fn defaults() -> *mut u8 {
    // SAFETY: the adapter of this very export.
    unsafe { bindings::_export_defaults_cabi::<Stress>() }
}

#[unsafe(export_name = "latchwork:device/stress@0.1.0#configure")]
unsafe extern "C" fn configure(refuse: i32, trap: i32) -> *mut u8 {
    // SAFETY: the adapter of this very export, with what the host passed.
    unsafe { bindings::_export_configure_cabi::<Stress>(refuse, trap) }
}

#[unsafe(export_name = "cabi_post_latchwork:device/stress@0.1.0#configure")]
unsafe extern "C" fn post_configure(result: *mut u8) {
    // SAFETY: the adapter of this very export, with what `configure` returned.
    unsafe { bindings::__post_return_configure::<Stress>(result) }
}

#[unsafe(export_name = "latchwork:device/stress@0.1.0#execute")]
unsafe extern "C" fn execute(
    now: i64,
    elapsed: i64,
    first: i32,
    burn: i32,
    fault: i32,
    from: i32,
    commands: i32,
) -> *mut u8 {
    // SAFETY: the adapter of this very export, with what the host passed.
    let outputs = unsafe { bindings::_export_execute_cabi::<Stress>(now, elapsed, first, burn, fault, from, commands) };
    for (offset, byte) in [(MODE, faults::bad_enum()), (ALIVE, faults::bad_bool())] {
        if let Some(byte) = byte {
            // SAFETY: the adapter returned its static return area, bytes that hold the 24 of `outputs` in the layout of the
            // canonical ABI. No Rust value of the types `Mode` or `bool` lives there: the host reads the bytes, nobody else.
            unsafe { outputs.add(offset).write_volatile(byte) };
        }
    }
    outputs
}

#[unsafe(export_name = "latchwork:device/stress@0.1.0#save")]
unsafe extern "C" fn save() -> i64 {
    // SAFETY: the adapter of this very export.
    unsafe { bindings::_export_save_cabi::<Stress>() }
}

#[unsafe(export_name = "latchwork:device/stress@0.1.0#restore")]
unsafe extern "C" fn restore(executions: i64) {
    // SAFETY: the adapter of this very export, with what the host passed.
    unsafe { bindings::_export_restore_cabi::<Stress>(executions) }
}
