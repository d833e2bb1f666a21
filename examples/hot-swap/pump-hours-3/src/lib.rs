//! Run time and starts of a pump, version 3: with a mistake that comes to light after 200 executions.
#![no_std]

struct PumpHours {
    settings: Settings,
    run_time: Duration,
    starts: u32,
    running: bool,
    last_run: Duration,
    /// Executions of the present window, for the load.
    executions: u64,
    /// Executions of it in which the pump ran.
    busy: u64,
}

impl Default for PumpHours {
    fn default() -> Self {
        Self {
            settings: Self::defaults(),
            run_time: Duration::ZERO,
            starts: 0,
            running: false,
            last_run: Duration::ZERO,
            executions: 0,
            busy: 0,
        }
    }
}

#[latchwork_sdk::block("waterworks:pump/pump-hours", wit = "../pump-hours-2/wit")]
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
        self.watch_load();
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

impl PumpHours {
    /// A log line when the pump was busy for most of the last 200 executions.
    fn watch_load(&mut self) {
        self.executions = (self.executions + 1) % 200;
        self.busy += u64::from(self.running);
        // The mistake: where a new window begins, there is nothing yet to divide by.
        if self.busy * 100 / self.executions > 90 && self.executions == 199 {
            latchwork_sdk::log::info!("busy {} of 200", self.busy);
            self.busy = 0;
        }
    }
}
