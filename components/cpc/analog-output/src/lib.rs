//! AnalogOutput of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};
use latchwork_sdk::flags;

#[derive(Default)]
struct AnalogOutput {
    settings: cpc::AnalogOutputSettings,
    output: cpc::AnalogOutput,
}

#[latchwork_sdk::block("latchwork:device/analog-output")]
impl AnalogOutput {
    fn defaults() -> Settings {
        let cpc::AnalogOutputSettings { low, high, raw_low, raw_high, rate_limit, start, forced_value } =
            cpc::AnalogOutputSettings::default();
        Settings { low, high, raw_low, raw_high, rate_limit, start, forced_value }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { low, high, raw_low, raw_high, rate_limit, start, forced_value } = settings;
        let settings = cpc::AnalogOutputSettings { low, high, raw_low, raw_high, rate_limit, start, forced_value };
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        let Inputs { order, io_error, simulated } = inputs;
        let order = logic::Signal::new(order.value, quality(order.quality));
        let inputs = cpc::AnalogOutputInputs { order, io_error, simulated };
        let cpc::AnalogOutputOutputs { raw, position, status } =
            self.output.execute(&self.settings, scan.elapsed, inputs, force_commands(commands));
        let alarms = flags([
            (Alarms::IO_ERROR, status.io_error),
            (Alarms::FORCED_DIFFERS, status.forced_differs),
            (Alarms::ORDER_INVALID, status.order_invalid),
        ]);
        (Outputs { raw, position, status: register(status) }, alarms)
    }

    fn save(&self) -> Retained {
        let cpc::AnalogOutput { force, order, position } = self.output;
        Retained {
            forced: force.active,
            is_ordered: order.is_some(),
            order: order.unwrap_or_default(),
            is_positioned: position.is_some(),
            position: position.unwrap_or_default(),
        }
    }

    fn restore(&mut self, state: Retained) {
        let Retained { forced, is_ordered, order, is_positioned, position } = state;
        self.output = cpc::AnalogOutput {
            force: cpc::AnalogForce { active: forced },
            order: is_ordered.then_some(order),
            position: is_positioned.then_some(position),
        };
    }
}

fn register(status: cpc::AnalogOutputStatus) -> StatusRegister {
    flags([
        (StatusRegister::FORCED, status.forced),
        (StatusRegister::IO_ERROR, status.io_error),
        (StatusRegister::SIMULATED, status.simulated),
        (StatusRegister::FORCED_DIFFERS, status.forced_differs),
        (StatusRegister::ORDER_INVALID, status.order_invalid),
        (StatusRegister::LIMITED, status.limited),
        (StatusRegister::RAMPING, status.ramping),
    ])
}

fn force_commands(commands: Commands) -> cpc::AnalogForceCommands {
    cpc::AnalogForceCommands {
        force: commands.contains(Commands::FORCE),
        unforce: commands.contains(Commands::UNFORCE),
    }
}

fn quality(quality: Quality) -> logic::Quality {
    match quality {
        Quality::Good => logic::Quality::Good,
        Quality::Uncertain => logic::Quality::Uncertain,
        Quality::Bad => logic::Quality::Bad,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    #[test]
    fn a_restored_block_goes_on_like_the_one_it_was_saved_from() {
        let settings = Settings { rate_limit: 1e9, start: 10.0, ..AnalogOutput::defaults() };
        let configured = || {
            let mut block = AnalogOutput::default();
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
        let quality = |a: bool, b: bool| if a && b { Quality::Bad } else { Quality::Good };
        let real = || (next() % 130) as f64 - 10.0;
        let mut block = configured();
        for step in 0..5_000 {
            let mut restored = configured();
            restored.restore(block.save());
            assert!(restored.output == block.output, "step {step}");
            let inputs =
                Inputs { order: RealSignal::new(real(), quality(bit(), bit())), io_error: bit(), simulated: bit() };
            let commands = Commands::from_bits_truncate((next() & next() & next()) as _);
            let scan = Scan { elapsed: next() % 3, ..Scan::default() };
            let (out, alarms) = block.execute(scan, inputs, commands);
            assert!(restored.execute(scan, inputs, commands) == (out, alarms), "step {step}");
        }
    }
}
