//! Multivibrator, as a component: the clock of a blinking lamp.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct Multivibrator {
    settings: logic::MultivibratorSettings,
    blink: logic::Multivibrator,
}

#[latchwork_sdk::block("latchwork:device/multivibrator")]
impl Multivibrator {
    fn defaults() -> Settings {
        let logic::MultivibratorSettings { on_time, off_time } = logic::MultivibratorSettings::default();
        Settings { on_time: Duration::from_nanos(on_time), off_time: Duration::from_nanos(off_time) }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let settings = logic::MultivibratorSettings { on_time: settings.on_time.ns, off_time: settings.off_time.ns };
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {
        Outputs { out: self.blink.execute(&self.settings, scan.elapsed, inputs.run) }
    }

    fn save(&self) -> Retained {
        let logic::Multivibrator { running, on, phase } = self.blink;
        Retained { running, on, phase: Duration::from_nanos(phase) }
    }

    fn restore(&mut self, state: Retained) {
        let Retained { running, on, phase } = state;
        self.blink = logic::Multivibrator { running, on, phase: phase.ns };
    }
}
