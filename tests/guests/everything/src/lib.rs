//! A device class that only tests know, with every kind of port. Its behaviour is written in `wit/kitchen-sink.wit`.
#![no_std]

/// Copies the fields that all records of the class share.
macro_rules! copy {
    ($from:expr => $to:ident { $($more:tt)* }) => {{
        let from = $from;
        $to {
            yes: from.yes, a: from.a, b: from.b, c: from.c, d: from.d, e: from.e, f: from.f, g: from.g, h: from.h,
            i: from.i, j: from.j, mode: from.mode, options: from.options, time: from.time, real: from.real,
            on: from.on, drive: from.drive, $($more)*
        }
    }};
}

#[derive(Default)]
struct KitchenSink {
    settings: Settings,
    configurations: u32,
    elapsed: Duration,
    retained: Retained,
}

#[latchwork_sdk::block("test:everything/kitchen-sink@1.2.0", wit = "wit")]
impl KitchenSink {
    fn defaults() -> Settings {
        let limits = Limits { low: -0.5, high: 1e300, mode: Mode::Manual };
        Settings {
            yes: true,
            a: 1,
            b: 65_535,
            c: 3_000_000_000,
            d: u64::MAX,
            e: -128,
            f: -2,
            g: i32::MIN,
            h: i64::MIN,
            i: 0.1,
            j: -0.1,
            mode: Mode::Automatic,
            options: Options::FAST | Options::VERBOSE,
            time: Duration::from_secs(1),
            real: RealSignal::new(1.5, Quality::Uncertain),
            on: BoolSignal::new(true, Quality::Bad),
            drive: Drive { speed: -1500, limits, torque: RealSignal::good(2.5) },
        }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), latchwork_sdk::String> {
        if settings.a == 255 {
            return Err(latchwork_sdk::format!("a is {}; expected 0 to 254", settings.a));
        }
        self.settings = settings;
        self.configurations += 1;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        let executions = self.retained.executions.wrapping_add(1);
        self.elapsed.ns = self.elapsed.ns.wrapping_add(scan.elapsed);
        let (configurations, elapsed, first) = (self.configurations, self.elapsed, scan.first);
        let outputs = match inputs.echo {
            Echo::Inputs => copy!(inputs => Outputs { executions, configurations, elapsed, first }),
            Echo::Settings => copy!(self.settings => Outputs { executions, configurations, elapsed, first }),
            Echo::Retained => copy!(self.retained => Outputs { executions, configurations, elapsed, first }),
        };
        self.retained = copy!(inputs => Retained { executions, last_commands: commands });
        (outputs, Alarms::from_bits_retain(commands.bits()))
    }

    fn save(&self) -> Retained {
        self.retained
    }

    fn restore(&mut self, state: Retained) {
        self.retained = state;
    }
}
