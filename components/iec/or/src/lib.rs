//! Disjunction of up to eight inputs: IEC 61131-3 OR as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct Or(logic::Gate);

#[latchwork_sdk::block("latchwork:device/or")]
impl Or {
    fn defaults() -> Settings {
        let logic::Gate { inputs } = logic::Gate::default();
        Settings { inputs }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let gate = logic::Gate { inputs: settings.inputs };
        gate.check()?;
        self.0 = gate;
        Ok(())
    }

    fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        let Inputs { in1, in2, in3, in4, in5, in6, in7, in8 } = inputs;
        Outputs { out: self.0.or([in1, in2, in3, in4, in5, in6, in7, in8]) }
    }
}
