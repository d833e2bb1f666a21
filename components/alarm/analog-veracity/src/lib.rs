//! Veracity check of an analogue signal, as a component: spikes, dips and line breaks are held off.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct AnalogVeracity {
    settings: logic::AnalogSettings,
    check: logic::AnalogVeracity,
}

#[latchwork_sdk::block("latchwork:device/analog-veracity")]
impl AnalogVeracity {
    fn defaults() -> Settings {
        let logic::AnalogSettings { max_step, period, average } = logic::AnalogSettings::default();
        Settings { max_step, period: Duration::from_nanos(period), average }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { max_step, period, average } = settings;
        let settings = logic::AnalogSettings { max_step, period: period.ns, average };
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> Outputs {
        if commands.contains(Commands::RESET) {
            self.check.reset();
        }
        let (out, error) = self.check.execute(&self.settings, scan.elapsed, inputs.on, to_logic(inputs.signal));
        Outputs { out: from_logic(out), error }
    }

    fn save(&self) -> Retained {
        let logic::AnalogState { accepted, error } = self.check.save();
        Retained { seeded: accepted.is_some(), accepted: accepted.unwrap_or_default(), error }
    }

    fn restore(&mut self, state: Retained) {
        let Retained { seeded, accepted, error } = state;
        self.check.restore(logic::AnalogState { accepted: seeded.then_some(accepted), error });
    }
}

fn to_logic(signal: RealSignal) -> logic::Signal {
    let quality = match signal.quality {
        Quality::Good => logic::Quality::Good,
        Quality::Uncertain => logic::Quality::Uncertain,
        Quality::Bad => logic::Quality::Bad,
    };
    logic::Signal::new(signal.value, quality)
}

fn from_logic(signal: logic::Signal) -> RealSignal {
    let quality = match signal.quality {
        logic::Quality::Good => Quality::Good,
        logic::Quality::Uncertain => Quality::Uncertain,
        logic::Quality::Bad => Quality::Bad,
    };
    RealSignal::new(signal.value, quality)
}
