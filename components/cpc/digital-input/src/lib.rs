//! DigitalInput of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};

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

/// The flags whose condition holds.
fn flags<T: FromIterator<T>, const N: usize>(all: [(T, bool); N]) -> T {
    all.into_iter().filter(|(_, holds)| *holds).map(|(flag, _)| flag).collect()
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
