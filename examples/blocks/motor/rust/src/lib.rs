//! A motor with a contactor: started and stopped by command, supervised by its feedback.

mod class;

use class::*;

pub struct Block {
    /// ns.
    timeout: u64,
    starts: u32,
    hours: f64,
    run: bool,
    alarms: Alarms,
    /// How long the feedback has not been as `run` wants it, ns.
    waiting: u64,
}

impl Default for Block {
    fn default() -> Self {
        Self { timeout: 0, starts: 0, hours: 0.0, run: false, alarms: Alarms::empty(), waiting: 0 }
    }
}

impl Block {
    pub fn configure(&mut self, settings: Settings) -> Result<(), String> {
        if settings.feedback_timeout.ns == 0 {
            return Err("feedback-timeout must be above 0".into());
        }
        self.timeout = settings.feedback_timeout.ns;
        Ok(())
    }

    pub fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        if commands.contains(Commands::RESET) {
            self.alarms = Alarms::empty();
        }
        let before = self.run;
        if commands.contains(Commands::STOP) || !inputs.interlock {
            self.run = false;
        } else if commands.contains(Commands::START) && !self.run && self.alarms.is_empty() {
            self.run = true;
            self.starts = self.starts.wrapping_add(1);
        }
        let settled = self.run != before || self.run == inputs.feedback;
        self.waiting = if settled { 0 } else { self.waiting.saturating_add(scan.elapsed) };
        if self.waiting >= self.timeout {
            self.alarms |= if self.run { Alarms::MISS_STARTING } else { Alarms::MISS_STOPPING };
            self.run = false;
            self.waiting = 0;
        }
        let running = self.run && inputs.feedback;
        if running {
            self.hours += scan.elapsed as f64 / 3.6e12;
        }
        (Outputs { run: self.run, running }, self.alarms)
    }

    pub fn save(&mut self) -> Retained {
        Retained { starts: self.starts, hours: self.hours }
    }

    pub fn restore(&mut self, state: Retained) {
        (self.starts, self.hours) = (state.starts, state.hours);
    }
}
