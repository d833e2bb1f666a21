//! What a run asks of the machine besides threads: memory that stays, CPUs that stay awake.

use rustix::mm::{MlockAllFlags, mlockall, munlockall};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CapabilitySet, capabilities};
use std::fs::File;
use std::io::Write;

/// Taken while a plant with interrupt lanes runs; given back when dropped.
#[derive(Default)]
pub(super) struct Machine {
    locked: bool,
    /// Held open, it keeps CPUs out of deep sleep.
    _awake: Option<File>,
}

impl Machine {
    /// Locks all memory, now and to come, into RAM (which also faults it in), and keeps the CPUs out of deep sleep where that
    /// is permitted. The sentence says what was refused.
    pub(super) fn prepare() -> (Self, Option<String>) {
        let refused = lock().err();
        (Self { locked: refused.is_none(), _awake: stay_awake() }, refused)
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        if self.locked {
            // Nothing depends on it any more.
            let _ = munlockall();
        }
    }
}

fn lock() -> Result<(), String> {
    // With a limit, locking what is to come would make later allocations fail, not this call.
    let unlimited = getrlimit(Resource::Memlock).current.is_none();
    let privileged = capabilities(None).is_ok_and(|c| c.effective.contains(CapabilitySet::IPC_LOCK));
    if !unlimited && !privileged {
        return Err("the limit of locked memory is too low".into());
    }
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).map_err(|e| e.to_string())
}

fn stay_awake() -> Option<File> {
    let mut file = File::options().write(true).open("/dev/cpu_dma_latency").ok()?;
    // Microseconds a CPU may take to wake, as a C int.
    file.write_all(&0i32.to_ne_bytes()).ok()?;
    Some(file)
}
