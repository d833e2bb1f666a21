//! Bounds check with hysteresis.

mod class;

use class::*;

pub struct Block {
    settings: Settings,
    high: bool,
    low: bool,
}

impl Default for Block {
    fn default() -> Self {
        Self { settings: Self::defaults(), high: false, low: false }
    }
}

impl Block {
    pub fn defaults() -> Settings {
        Settings { low_limit: 10.0, high_limit: 50.0, hysteresis: 1.0 }
    }

    pub fn configure(&mut self, settings: Settings) -> Result<(), String> {
        let Settings { low_limit, high_limit, hysteresis } = settings;
        if !low_limit.is_finite() {
            return Err(format!("low-limit {low_limit} must be a finite number"));
        }
        if !high_limit.is_finite() {
            return Err(format!("high-limit {high_limit} must be a finite number"));
        }
        if low_limit >= high_limit {
            return Err(format!("low-limit {low_limit} must be below high-limit {high_limit}"));
        }
        if !hysteresis.is_finite() || hysteresis < 0.0 {
            return Err(format!("hysteresis {hysteresis} must be a finite number, 0 or more"));
        }
        self.settings = settings;
        Ok(())
    }

    pub fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        let signal = inputs.signal;
        let Settings { low_limit, high_limit, hysteresis } = self.settings;
        let error = signal.is_nan();
        if !error {
            let (above, below) = (signal > high_limit, signal < low_limit);
            // Beyond one limit, the other flag goes whatever the hysteresis.
            self.high = above || (self.high && !below && signal >= high_limit - hysteresis);
            self.low = below || (self.low && !above && signal <= low_limit + hysteresis);
        }
        Outputs { high: self.high, low: self.low, error }
    }

    pub fn save(&mut self) -> Retained {
        Retained { high: self.high, low: self.low }
    }

    pub fn restore(&mut self, state: Retained) {
        (self.high, self.low) = (state.high, state.low);
    }
}
