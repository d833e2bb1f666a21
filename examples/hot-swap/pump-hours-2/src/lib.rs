//! Run time and starts of a pump, version 2: more starts than fit 16 bits, service after a number of them, the last run.
#![no_std]

struct PumpHours {
    settings: Settings,
    run_time: Duration,
    starts: u32,
    running: bool,
    last_run: Duration,
}

impl Default for PumpHours {
    fn default() -> Self {
        Self {
            settings: Self::defaults(),
            run_time: Duration::ZERO,
            starts: 0,
            running: false,
            last_run: Duration::ZERO,
        }
    }
}

#[latchwork_sdk::block("waterworks:pump/pump-hours", wit = "wit")]
impl PumpHours {
    fn defaults() -> Settings {
        Settings { service_after: Duration::from_secs(500 * 3600), service_starts: 0 }
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
            self.last_run.ns = self.last_run.ns.saturating_add(scan.elapsed);
        } else if inputs.running {
            self.last_run = Duration::ZERO;
            self.starts = self.starts.saturating_add(1);
        }
        self.running = inputs.running;
        let Settings { service_after, service_starts } = self.settings;
        let due = service_after > Duration::ZERO && self.run_time >= service_after
            || service_starts > 0 && self.starts >= service_starts;
        let alarms = if due { Alarms::SERVICE_DUE } else { Alarms::empty() };
        (Outputs { run_time: self.run_time, starts: self.starts, last_run: self.last_run }, alarms)
    }

    fn save(&self) -> Retained {
        Retained { run_time: self.run_time, starts: self.starts, running: self.running, last_run: self.last_run }
    }

    fn restore(&mut self, state: Retained) {
        Retained { run_time: self.run_time, starts: self.starts, running: self.running, last_run: self.last_run } =
            state;
    }
}
