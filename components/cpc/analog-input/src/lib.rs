//! AnalogInput of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};
use latchwork_sdk::flags;

#[derive(Default)]
struct AnalogInput {
    settings: cpc::AnalogInputSettings,
    input: cpc::AnalogInput,
}

#[latchwork_sdk::block("latchwork:device/analog-input")]
impl AnalogInput {
    fn defaults() -> Settings {
        let logic = cpc::AnalogInputSettings::default();
        let cpc::AnalogInputSettings { raw_low, raw_high, low, high, margin, deadband, forced_value, .. } = logic;
        let filter_time = Duration::from_nanos(logic.filter_time);
        Settings { raw_low, raw_high, low, high, margin, deadband, filter_time, forced_value }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { raw_low, raw_high, low, high, margin, deadband, filter_time, forced_value } = settings;
        let filter_time = filter_time.ns;
        let settings =
            cpc::AnalogInputSettings { raw_low, raw_high, low, high, margin, deadband, filter_time, forced_value };
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        let raw = logic::Signal::new(inputs.raw.value, quality(inputs.raw.quality));
        let cpc::AnalogInputOutputs { value, measured, status } =
            self.input.execute(&self.settings, scan.elapsed, raw, inputs.simulated, force_commands(commands));
        let alarms = flags([(Alarms::IO_ERROR, status.io_error), (Alarms::FORCED_DIFFERS, status.forced_differs)]);
        let value = RealSignal::new(value.value, from_logic(value.quality));
        (Outputs { value, measured, status: register(status) }, alarms)
    }

    fn save(&self) -> Retained {
        let cpc::AnalogInput { force, filtered, measured } = self.input;
        Retained {
            forced: force.active,
            is_filtering: filtered.is_some(),
            filtered: filtered.unwrap_or_default(),
            is_measured: measured.is_some(),
            measured: measured.unwrap_or_default(),
        }
    }

    fn restore(&mut self, state: Retained) {
        let Retained { forced, is_filtering, filtered, is_measured, measured } = state;
        self.input = cpc::AnalogInput {
            force: cpc::AnalogForce { active: forced },
            filtered: is_filtering.then_some(filtered),
            measured: is_measured.then_some(measured),
        };
    }
}

fn register(status: cpc::AnalogInputStatus) -> StatusRegister {
    flags([
        (StatusRegister::FORCED, status.forced),
        (StatusRegister::IO_ERROR, status.io_error),
        (StatusRegister::SIMULATED, status.simulated),
        (StatusRegister::FORCED_DIFFERS, status.forced_differs),
        (StatusRegister::BELOW_RANGE, status.below_range),
        (StatusRegister::ABOVE_RANGE, status.above_range),
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

fn from_logic(quality: logic::Quality) -> Quality {
    match quality {
        logic::Quality::Good => Quality::Good,
        logic::Quality::Uncertain => Quality::Uncertain,
        logic::Quality::Bad => Quality::Bad,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    #[test]
    fn a_restored_block_goes_on_like_the_one_it_was_saved_from() {
        let settings = Settings {
            deadband: 0.01,
            filter_time: Duration::from_nanos(3),
            forced_value: 0.1,
            ..AnalogInput::defaults()
        };
        let configured = || {
            let mut block = AnalogInput::default();
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
            assert!(restored.input == block.input, "step {step}");
            let inputs = Inputs { raw: RealSignal::new(real(), quality(bit(), bit())), simulated: bit() };
            let commands = Commands::from_bits_truncate((next() & next() & next()) as _);
            let scan = Scan { elapsed: next() % 3, ..Scan::default() };
            let (out, alarms) = block.execute(scan, inputs, commands);
            assert!(restored.execute(scan, inputs, commands) == (out, alarms), "step {step}");
        }
    }
}
