//! Bounds check with hysteresis, as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct BoundsCheck {
    settings: logic::BoundsSettings,
    check: logic::BoundsCheck,
}

#[latchwork_sdk::block("latchwork:device/bounds-check")]
impl BoundsCheck {
    fn defaults() -> Settings {
        let logic::BoundsSettings { low_limit, high_limit, hysteresis } = logic::BoundsSettings::default();
        Settings { low_limit, high_limit, hysteresis }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { low_limit, high_limit, hysteresis } = settings;
        let settings = logic::BoundsSettings { low_limit, high_limit, hysteresis };
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        let error = self.check.execute(&self.settings, inputs.signal);
        Outputs { high: self.check.high.q1, low: self.check.low.q1, error }
    }

    fn save(&self) -> Retained {
        Retained { high: self.check.high.q1, low: self.check.low.q1 }
    }

    fn restore(&mut self, state: Retained) {
        let rs = |q1| logic::Rs { q1 };
        self.check = logic::BoundsCheck { high: rs(state.high), low: rs(state.low) };
    }
}
