//! Up-down counter: IEC 61131-3 CTUD as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct Ctud(logic::Ctud);

#[latchwork_sdk::block("latchwork:device/ctud")]
impl Ctud {
    fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        let Inputs { cu, cd, r, ld, pv } = inputs;
        let (qu, qd) = self.0.execute(cu, cd, r, ld, pv);
        Outputs { qu, qd, cv: self.0.cv }
    }

    fn save(&self) -> Retained {
        Retained { cv: self.0.cv, cu: self.0.cu.m, cd: self.0.cd.m }
    }

    fn restore(&mut self, state: Retained) {
        let trig = |m| logic::RTrig { m };
        self.0 = logic::Ctud { cv: state.cv, cu: trig(state.cu), cd: trig(state.cd) };
    }
}
