//! Up counter: IEC 61131-3 CTU as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct Ctu(logic::Ctu);

#[latchwork_sdk::block("latchwork:device/ctu")]
impl Ctu {
    fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        let q = self.0.execute(inputs.cu, inputs.r, inputs.pv);
        Outputs { q, cv: self.0.cv }
    }

    fn save(&self) -> Retained {
        Retained { cv: self.0.cv, cu: self.0.cu.m }
    }

    fn restore(&mut self, state: Retained) {
        self.0 = logic::Ctu { cv: state.cv, cu: logic::RTrig { m: state.cu } };
    }
}
