//! AnalogInput of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};

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

/// The flags whose condition holds.
fn flags<T: FromIterator<T>, const N: usize>(all: [(T, bool); N]) -> T {
    all.into_iter().filter(|(_, holds)| *holds).map(|(flag, _)| flag).collect()
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
