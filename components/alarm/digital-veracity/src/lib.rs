//! Veracity check of a binary signal, as a component: bounce and short disappearances are ignored.
#![no_std]

use latchwork_logic as logic;

struct DigitalVeracity {
    time: Duration,
    check: logic::DigitalVeracity,
}

impl Default for DigitalVeracity {
    fn default() -> Self {
        Self { time: Self::defaults().time, check: logic::DigitalVeracity::default() }
    }
}

#[latchwork_sdk::block("latchwork:device/digital-veracity")]
impl DigitalVeracity {
    fn defaults() -> Settings {
        Settings { time: Duration::from_millis(50) }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), core::convert::Infallible> {
        self.time = settings.time;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> Outputs {
        if commands.contains(Commands::RESET) {
            self.check.reset();
        }
        Outputs { dout: self.check.execute(scan.elapsed, inputs.din, self.time.ns) }
    }

    fn save(&self) -> Retained {
        let logic::DigitalState { dout, din, held } = self.check.save();
        Retained { dout, din, held: Duration::from_nanos(held) }
    }

    fn restore(&mut self, state: Retained) {
        let Retained { dout, din, held } = state;
        self.check.restore(logic::DigitalState { dout, din, held: held.ns });
    }
}
