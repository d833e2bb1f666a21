//! Rising edge detection: IEC 61131-3 R_TRIG as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct RTrig(logic::RTrig);

#[latchwork_sdk::block("latchwork:device/r-trig")]
impl RTrig {
    fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        Outputs { q: self.0.execute(inputs.clk) }
    }

    fn save(&self) -> Retained {
        Retained { m: self.0.m }
    }

    fn restore(&mut self, state: Retained) {
        self.0.m = state.m;
    }
}
