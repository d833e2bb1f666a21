//! Falling edge detection: IEC 61131-3 F_TRIG as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct FTrig(logic::FTrig);

#[latchwork_sdk::block("latchwork:device/f-trig")]
impl FTrig {
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
