//! DigitalOutput of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};
use latchwork_sdk::flags;

#[derive(Default)]
struct DigitalOutput {
    settings: cpc::DigitalOutputSettings,
    output: cpc::DigitalOutput,
}

#[latchwork_sdk::block("latchwork:device/digital-output")]
impl DigitalOutput {
    fn defaults() -> Settings {
        let cpc::DigitalOutputSettings { inverted, has_readback, mismatch_time } =
            cpc::DigitalOutputSettings::default();
        Settings { inverted, has_readback, mismatch_time: Duration::from_nanos(mismatch_time) }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { inverted, has_readback, mismatch_time } = settings;
        self.settings = cpc::DigitalOutputSettings { inverted, has_readback, mismatch_time: mismatch_time.ns };
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        let Inputs { order, readback, io_error, simulated } = inputs;
        let inputs = cpc::DigitalOutputInputs { order, readback, io_error, simulated };
        let cpc::DigitalOutputOutputs { output, status } =
            self.output.execute(&self.settings, scan.elapsed, inputs, force_commands(commands));
        let alarms = flags([
            (Alarms::IO_ERROR, status.io_error),
            (Alarms::FORCED_DIFFERS, status.forced_differs),
            (Alarms::MISMATCH, status.mismatch),
        ]);
        (Outputs { output, status: register(status) }, alarms)
    }

    fn save(&self) -> Retained {
        let cpc::DigitalOutput { force, readback } = self.output;
        Retained {
            forced: force.active,
            forced_position: force.value,
            output: readback.order,
            differs: readback.differs,
            differs_for: Duration::from_nanos(readback.elapsed),
        }
    }

    fn restore(&mut self, state: Retained) {
        let Retained { forced, forced_position, output, differs, differs_for } = state;
        self.output = cpc::DigitalOutput {
            force: cpc::Force { active: forced, value: forced_position },
            readback: cpc::Supervision { order: output, differs, elapsed: differs_for.ns },
        };
    }
}

fn register(status: cpc::DigitalOutputStatus) -> StatusRegister {
    flags([
        (StatusRegister::POSITION, status.position),
        (StatusRegister::FORCED, status.forced),
        (StatusRegister::IO_ERROR, status.io_error),
        (StatusRegister::SIMULATED, status.simulated),
        (StatusRegister::ORDER, status.order),
        (StatusRegister::FORCED_DIFFERS, status.forced_differs),
        (StatusRegister::MISMATCH, status.mismatch),
    ])
}

fn force_commands(commands: Commands) -> cpc::ForceCommands {
    cpc::ForceCommands {
        force_true: commands.contains(Commands::FORCE_TRUE),
        force_false: commands.contains(Commands::FORCE_FALSE),
        unforce: commands.contains(Commands::UNFORCE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    #[test]
    fn a_restored_block_goes_on_like_the_one_it_was_saved_from() {
        let settings =
            Settings { has_readback: true, mismatch_time: Duration::from_nanos(4), ..DigitalOutput::defaults() };
        let configured = || {
            let mut block = DigitalOutput::default();
            block.configure(settings).expect("accepted");
            block
        };
        let seed = Cell::new(0x2545_f491_4f6c_dd1d_u64);
        let next = || {
            let x = seed.get() ^ (seed.get() << 13);
            let x = x ^ (x >> 7);
            seed.set(x ^ (x << 17));
            seed.get() >> 20
        };
        let bit = || next() % 2 == 0;
        let mut block = configured();
        for step in 0..5_000 {
            let mut restored = configured();
            restored.restore(block.save());
            assert!(restored.output == block.output, "step {step}");
            let inputs = Inputs { order: bit(), readback: bit(), io_error: bit(), simulated: bit() };
            let commands = Commands::from_bits_truncate((next() & next() & next()) as _);
            let scan = Scan { elapsed: next() % 3, ..Scan::default() };
            let (out, alarms) = block.execute(scan, inputs, commands);
            assert!(restored.execute(scan, inputs, commands) == (out, alarms), "step {step}");
        }
    }
}
