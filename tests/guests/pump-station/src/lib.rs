//! Keeps a tank between two levels with one pump.
#![no_std]

struct PumpStation {
    settings: Settings,
    pump: bool,
    since_start: Duration,
    starts: u32,
}

impl Default for PumpStation {
    fn default() -> Self {
        let settings = Self::defaults();
        // The first start waits for nothing.
        Self { settings, pump: false, since_start: settings.pause, starts: 0 }
    }
}

#[latchwork_sdk::block("waterworks:station/pump-station", wit = "wit")]
impl PumpStation {
    fn defaults() -> Settings {
        Settings { start_below: 1.0, stop_above: 3.0, pause: Duration::from_secs(10) }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), &'static str> {
        let Settings { start_below, stop_above, .. } = settings;
        if !(start_below.is_finite() && stop_above.is_finite() && start_below < stop_above) {
            return Err("start-below must be less than stop-above, both finite");
        }
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        self.since_start.ns = self.since_start.ns.saturating_add(scan.elapsed);
        let level = inputs.level;
        let bad = level.quality == Quality::Bad || level.value.is_nan();
        let due = level.value < self.settings.start_below && self.since_start >= self.settings.pause;
        if bad || level.value > self.settings.stop_above {
            self.pump = false;
        } else if !self.pump && (due || commands.contains(Commands::START)) {
            self.pump = true;
            self.since_start = Duration::ZERO;
            self.starts = self.starts.saturating_add(1);
        }
        let alarms = if bad { Alarms::LEVEL_BAD } else { Alarms::empty() };
        (Outputs { pump: self.pump }, alarms)
    }

    fn save(&self) -> Retained {
        Retained { starts: self.starts }
    }

    fn restore(&mut self, state: Retained) {
        self.starts = state.starts;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn execute(block: &mut PumpStation, level: RealSignal) -> (bool, Alarms) {
        let scan = Scan { elapsed: Duration::from_secs(1).ns, ..Scan::default() };
        let (outputs, alarms) = block.execute(scan, Inputs { level }, Commands::empty());
        (outputs.pump, alarms)
    }

    #[test]
    fn pumps_from_the_low_level_to_the_high_one() {
        let mut block = PumpStation::default();
        let pump: [bool; 5] = [2.0, 0.9, 2.0, 3.1, 2.0].map(|level| execute(&mut block, RealSignal::good(level)).0);
        assert_eq!(pump, [false, true, true, false, false]);
    }

    #[test]
    fn a_bad_level_stops_the_pump_and_raises_the_alarm() {
        let mut block = PumpStation::default();
        assert_eq!(execute(&mut block, RealSignal::good(0.5)), (true, Alarms::empty()));
        assert_eq!(execute(&mut block, RealSignal::new(0.5, Quality::Bad)), (false, Alarms::LEVEL_BAD));
    }

    #[test]
    fn limits_the_wrong_way_round_are_refused() {
        let settings = Settings { start_below: 4.0, ..PumpStation::defaults() };
        assert!(PumpStation::default().configure(settings).is_err());
    }
}
