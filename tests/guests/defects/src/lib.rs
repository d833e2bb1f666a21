//! One class for each defect that a fuzzer must find; what is wrong with each is written in `wit/defects.wit`.
#![no_std]

mod trap_above {
    #[derive(Default)]
    struct TrapAbove;

    #[latchwork_sdk::block("test:defects/trap-above", wit = "wit")]
    impl TrapAbove {
        fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
            let good = matches!(inputs.level.quality, Quality::Good);
            assert!(!(inputs.armed && good && inputs.level.value > 80.0));
            Outputs { good }
        }
    }
}

mod trap_late {
    #[derive(Default)]
    struct TrapLate {
        executions: u32,
    }

    #[latchwork_sdk::block("test:defects/trap-late", wit = "wit")]
    impl TrapLate {
        fn execute(&mut self, _scan: Scan, _inputs: Inputs) -> Outputs {
            self.executions += 1;
            assert!(self.executions < 3000);
            Outputs { executions: self.executions }
        }
    }
}

mod endless {
    #[derive(Default)]
    struct Endless {
        running: bool,
    }

    #[latchwork_sdk::block("test:defects/endless", wit = "wit")]
    impl Endless {
        fn execute(&mut self, _scan: Scan, inputs: Inputs, commands: Commands) -> Outputs {
            self.running |= commands.contains(Commands::START);
            self.running &= !commands.contains(Commands::STOP);
            while self.running && matches!(inputs.mode, Mode::Manual) {
                core::hint::black_box(&mut *self);
            }
            Outputs { running: self.running }
        }
    }
}

mod slow {
    const HOUR: u64 = 3_600_000_000_000;

    #[derive(Default)]
    struct Slow;

    #[latchwork_sdk::block("test:defects/slow", wit = "wit")]
    impl Slow {
        fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {
            let mut count = 0;
            while inputs.on && scan.elapsed > HOUR && count < 20_000_000 {
                count = core::hint::black_box(count + 1);
            }
            Outputs { count }
        }
    }
}

mod leak {
    use latchwork_sdk::Vec;

    #[derive(Default)]
    struct Leak {
        leaks: u32,
    }

    #[latchwork_sdk::block("test:defects/leak", wit = "wit")]
    impl Leak {
        fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
            if inputs.on {
                self.leaks += 1;
                core::mem::forget(core::hint::black_box(Vec::<u64>::with_capacity(4)));
            }
            Outputs { leaks: self.leaks }
        }
    }
}

mod forgetful {
    #[derive(Default)]
    struct Forgetful {
        clk: bool,
        count: u32,
    }

    #[latchwork_sdk::block("test:defects/forgetful", wit = "wit")]
    impl Forgetful {
        fn execute(&mut self, _scan: Scan, inputs: Inputs) -> (Outputs, Alarms) {
            if inputs.clk && !self.clk {
                self.count = self.count.saturating_add(1);
            }
            self.clk = inputs.clk;
            (Outputs { count: self.count }, latchwork_sdk::flags([(Alarms::MANY, self.count >= 3)]))
        }

        fn save(&self) -> Retained {
            Retained { count: self.count }
        }

        fn restore(&mut self, state: Retained) {
            self.count = state.count;
        }
    }
}

mod save_resets {
    use core::cell::Cell;

    #[derive(Default)]
    struct SaveResets {
        count: Cell<u32>,
    }

    #[latchwork_sdk::block("test:defects/save-resets", wit = "wit")]
    impl SaveResets {
        fn execute(&mut self, _scan: Scan, _inputs: Inputs) -> Outputs {
            self.count.set(self.count.get().saturating_add(1));
            Outputs { count: self.count.get() }
        }

        fn save(&self) -> Retained {
            Retained { count: self.count.take() }
        }

        fn restore(&mut self, state: Retained) {
            // As `save` left the other one.
            let _ = state;
        }
    }
}

mod half_refused {
    #[derive(Default)]
    struct HalfRefused {
        limit: f64,
    }

    #[latchwork_sdk::block("test:defects/half-refused", wit = "wit")]
    impl HalfRefused {
        fn defaults() -> Settings {
            Settings { limit: 50.0, hysteresis: 1.0 }
        }

        fn configure(&mut self, settings: Settings) -> Result<(), &'static str> {
            self.limit = settings.limit;
            if settings.hysteresis < settings.limit { Ok(()) } else { Err("hysteresis must be below limit") }
        }

        fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
            Outputs { high: inputs.level > self.limit }
        }
    }
}

mod quotient {
    #[derive(Default)]
    struct Quotient;

    #[latchwork_sdk::block("test:defects/quotient", wit = "wit")]
    impl Quotient {
        fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
            Outputs { q: inputs.a / inputs.b }
        }
    }
}
