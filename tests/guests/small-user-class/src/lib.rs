//! The smallest block of a user's own class: two inputs, one output, no state.
#![no_std]

#[derive(Default)]
struct Conveyor;

#[latchwork_sdk::block("workshop:drives/conveyor", wit = "wit")]
impl Conveyor {
    fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        Outputs { running: inputs.request && inputs.speed >= 0.1 }
    }
}
