//! Down counter: IEC 61131-3 CTD as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct Ctd(logic::Ctd);

#[latchwork_sdk::block("latchwork:device/ctd")]
impl Ctd {
    fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        let q = self.0.execute(inputs.cd, inputs.ld, inputs.pv);
        Outputs { q, cv: self.0.cv }
    }

    fn save(&self) -> Retained {
        Retained { cv: self.0.cv, cd: self.0.cd.m }
    }

    fn restore(&mut self, state: Retained) {
        self.0 = logic::Ctd { cv: state.cv, cd: logic::RTrig { m: state.cd } };
    }
}
