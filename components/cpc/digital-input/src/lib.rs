//! DigitalInput of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};
use latchwork_sdk::flags;

#[derive(Default)]
struct DigitalInput {
    settings: cpc::DigitalInputSettings,
    input: cpc::DigitalInput,
}

#[latchwork_sdk::block("latchwork:device/digital-input")]
impl DigitalInput {
    fn defaults() -> Settings {
        let cpc::DigitalInputSettings { inverted } = cpc::DigitalInputSettings::default();
        Settings { inverted }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        self.settings = cpc::DigitalInputSettings { inverted: settings.inverted };
        Ok(())
    }

    fn execute(&mut self, _scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        let Inputs { raw, simulated } = inputs;
        let cpc::DigitalInputOutputs { position, status } =
            self.input.execute(&self.settings, binary(raw), simulated, force_commands(commands));
        let alarms = flags([(Alarms::IO_ERROR, status.io_error), (Alarms::FORCED_DIFFERS, status.forced_differs)]);
        let position = BoolSignal::new(position.value, from_logic(position.quality));
        (Outputs { position, status: register(status) }, alarms)
    }

    fn save(&self) -> Retained {
        let cpc::Force { active, value } = self.input.force;
        Retained { forced: active, forced_position: value }
    }

    fn restore(&mut self, state: Retained) {
        self.input.force = cpc::Force { active: state.forced, value: state.forced_position };
    }
}

fn register(status: cpc::DigitalInputStatus) -> StatusRegister {
    flags([
        (StatusRegister::POSITION, status.position),
        (StatusRegister::FORCED, status.forced),
        (StatusRegister::IO_ERROR, status.io_error),
        (StatusRegister::SIMULATED, status.simulated),
        (StatusRegister::MEASURED, status.measured),
        (StatusRegister::FORCED_DIFFERS, status.forced_differs),
    ])
}

fn force_commands(commands: Commands) -> cpc::ForceCommands {
    cpc::ForceCommands {
        force_true: commands.contains(Commands::FORCE_TRUE),
        force_false: commands.contains(Commands::FORCE_FALSE),
        unforce: commands.contains(Commands::UNFORCE),
    }
}

fn binary(signal: BoolSignal) -> cpc::Binary {
    cpc::Binary::new(signal.value, quality(signal.quality))
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
        let settings = Settings { inverted: true };
        let configured = || {
            let mut block = DigitalInput::default();
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
        let mut block = configured();
        for step in 0..5_000 {
            let mut restored = configured();
            restored.restore(block.save());
            assert!(restored.input == block.input, "step {step}");
            let inputs = Inputs { raw: BoolSignal::new(bit(), quality(bit(), bit())), simulated: bit() };
            let commands = Commands::from_bits_truncate((next() & next() & next()) as _);
            let scan = Scan { elapsed: next() % 3, ..Scan::default() };
            let (out, alarms) = block.execute(scan, inputs, commands);
            assert!(restored.execute(scan, inputs, commands) == (out, alarms), "step {step}");
        }
    }
}
