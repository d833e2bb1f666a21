//! Reset-dominant flip-flop: IEC 61131-3 RS as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct Rs(logic::Rs);

#[latchwork_sdk::block("latchwork:device/rs")]
impl Rs {
    fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        Outputs { q1: self.0.execute(inputs.s, inputs.r1) }
    }

    fn save(&self) -> Retained {
        Retained { q1: self.0.q1 }
    }

    fn restore(&mut self, state: Retained) {
        self.0.q1 = state.q1;
    }
}
