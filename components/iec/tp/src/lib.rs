//! Pulse timer: IEC 61131-3 TP as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct Tp(logic::Tp);

#[latchwork_sdk::block("latchwork:device/tp")]
impl Tp {
    fn execute(&mut self, scan: Scan, inputs: Inputs) -> Outputs {
        let q = self.0.execute(scan.elapsed, inputs.in_, inputs.pt.ns);
        Outputs { q, et: Duration::from_nanos(self.0.et) }
    }

    fn save(&self) -> Retained {
        Retained { in_: self.0.input, q: self.0.q, et: Duration::from_nanos(self.0.et) }
    }

    fn restore(&mut self, state: Retained) {
        self.0 = logic::Tp { input: state.in_, q: state.q, et: state.et.ns };
    }
}
