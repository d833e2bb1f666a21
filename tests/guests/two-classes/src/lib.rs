//! One component, two device classes: polymorphism. Each block lives in its own module, as the types of both classes
//! have the same names.
#![no_std]

mod rising {
    #[derive(Default)]
    struct Rising {
        m: bool,
    }

    #[latchwork_sdk::block("latchwork:device/r-trig")]
    impl Rising {
        fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
            let q = inputs.clk && !self.m;
            self.m = inputs.clk;
            Outputs { q }
        }

        fn save(&self) -> Retained {
            Retained { m: self.m }
        }

        fn restore(&mut self, state: Retained) {
            self.m = state.m;
        }
    }
}

mod falling {
    #[derive(Default)]
    struct Falling {
        m: bool,
    }

    #[latchwork_sdk::block("latchwork:device/f-trig")]
    impl Falling {
        fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
            let q = !inputs.clk && !self.m;
            self.m = !inputs.clk;
            Outputs { q }
        }

        fn save(&self) -> Retained {
            Retained { m: self.m }
        }

        fn restore(&mut self, state: Retained) {
            self.m = state.m;
        }
    }
}
