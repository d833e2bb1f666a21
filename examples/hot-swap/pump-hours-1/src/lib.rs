//! Run time and starts of a pump, version 1.
#![no_std]

struct PumpHours {
    settings: Settings,
    run_time: Duration,
    starts: u16,
    running: bool,
}

impl Default for PumpHours {
    fn default() -> Self {
        Self { settings: Self::defaults(), run_time: Duration::ZERO, starts: 0, running: false }
    }
}

#[latchwork_sdk::block("waterworks:pump/pump-hours", wit = "wit")]
impl PumpHours {
    fn defaults() -> Settings {
        Settings { service_after: Duration::from_secs(500 * 3600) }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), core::convert::Infallible> {
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        if commands.contains(Commands::SERVICED) {
            (self.run_time, self.starts) = (Duration::ZERO, 0);
        }
        // The time since the last execution belongs to what the pump did then.
        if self.running {
            self.run_time.ns = self.run_time.ns.saturating_add(scan.elapsed);
        } else if inputs.running {
            self.starts = self.starts.saturating_add(1);
        }
        self.running = inputs.running;
        let after = self.settings.service_after;
        let due = after > Duration::ZERO && self.run_time >= after;
        let alarms = if due { Alarms::SERVICE_DUE } else { Alarms::empty() };
        (Outputs { run_time: self.run_time, starts: self.starts.into() }, alarms)
    }

    fn save(&self) -> Retained {
        Retained { run_time: self.run_time, starts: self.starts, running: self.running }
    }

    fn restore(&mut self, state: Retained) {
        Retained { run_time: self.run_time, starts: self.starts, running: self.running } = state;
    }
}
