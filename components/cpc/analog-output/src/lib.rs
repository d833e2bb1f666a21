//! AnalogOutput of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};

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
