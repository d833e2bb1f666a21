//! Set-dominant flip-flop: IEC 61131-3 SR as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct Sr(logic::Sr);

#[latchwork_sdk::block("latchwork:device/sr")]
impl Sr {
    fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        Outputs { q1: self.0.execute(inputs.s1, inputs.r) }
    }

    fn save(&self) -> Retained {
        Retained { q1: self.0.q1 }
    }

    fn restore(&mut self, state: Retained) {
        self.0.q1 = state.q1;
    }
}
