//! The block as its class has it: what each function does when it is not asked to misbehave, and which fault it is asked for.

use crate::exports::bindings::{Commands, Fault, Guest, Inputs, Mode, Outputs, Retained, Scan, Settings};
use crate::faults;
use core::sync::atomic::{AtomicU32, AtomicU64, Ordering::Relaxed};
use latchwork_sdk::String;

/// Executions, over restarts.
static EXECUTIONS: AtomicU64 = AtomicU64::new(0);
/// Executions of this instance.
static OF_INSTANCE: AtomicU32 = AtomicU32::new(0);

/// The block; its state is in statics, as wasm has one thread and a component one instance.
pub(crate) struct Stress;

impl Guest for Stress {
    fn defaults() -> Settings {
        Settings { refuse: false, trap: false }
    }

    fn configure(settings: Settings) -> Result<(), String> {
        if settings.trap {
            faults::trap();
        }
        if settings.refuse {
            return Err("refuse true must be false: refused, as these settings ask".into());
        }
        Ok(())
    }

    fn execute(_: Scan, inputs: Inputs, commands: Commands) -> Outputs {
        faults::burn(inputs.burn);
        let executions = EXECUTIONS.load(Relaxed).saturating_add(1);
        EXECUTIONS.store(executions, Relaxed);
        let of_instance = OF_INSTANCE.load(Relaxed).saturating_add(1);
        OF_INSTANCE.store(of_instance, Relaxed);

        let asked =
            |command, fault| commands.contains(command) || (inputs.fault == fault && of_instance >= inputs.from);
        if asked(Commands::TRAP, Fault::Trap) {
            faults::trap();
        }
        if asked(Commands::DIVIDE_BY_ZERO, Fault::DivideByZero) {
            faults::divide_by_zero();
        }
        if asked(Commands::ENDLESS_LOOP, Fault::EndlessLoop) {
            faults::endless_loop();
        }
        if asked(Commands::GROW_MEMORY, Fault::GrowMemory) {
            faults::grow_memory();
        }
        if asked(Commands::RECURSE, Fault::Recurse) {
            faults::recurse();
        }
        if asked(Commands::FLOOD_LOG, Fault::FloodLog) {
            faults::flood_log();
        }
        faults::spoil(asked(Commands::BAD_ENUM, Fault::BadEnum), asked(Commands::BAD_BOOL, Fault::BadBool));
        Outputs {
            executions,
            value: if asked(Commands::NAN, Fault::Nan) { f64::NAN } else { executions as f64 / 2.0 },
            mode: if executions.is_multiple_of(2) { Mode::Even } else { Mode::Odd },
            alive: true,
        }
    }

    fn save() -> Retained {
        Retained { executions: EXECUTIONS.load(Relaxed) }
    }

    fn restore(state: Retained) {
        EXECUTIONS.store(state.executions, Relaxed);
    }
}
