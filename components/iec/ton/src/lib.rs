//! On-delay timer: IEC 61131-3 TON as a component.
#![no_std]

#[derive(Default)]
struct Ton {
    input: bool,
    q: bool,
    et: Duration,
}

#[latchwork_sdk::block("latchwork:device/ton")]
impl Ton {
    fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {
        if !inputs.in_ {
            self.q = false;
            self.et = Duration::ZERO;
        } else if !self.q {
            if self.input {
                self.et.ns = self.et.ns.saturating_add(scan.elapsed).min(inputs.pt.ns);
            }
            self.q = self.et >= inputs.pt;
        }
        self.input = inputs.in_;
        Outputs { q: self.q, et: self.et }
    }

    fn save(&self) -> Retained {
        Retained { in_: self.input, q: self.q, et: self.et }
    }

    fn restore(&mut self, state: Retained) {
        (self.input, self.q, self.et) = (state.in_, state.q, state.et);
    }
}
