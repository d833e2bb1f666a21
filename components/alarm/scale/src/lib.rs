//! Linear scaling of a raw word to an engineering value, as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct Scale(logic::Scale);

#[latchwork_sdk::block("latchwork:device/scale")]
impl Scale {
    fn defaults() -> Settings {
        let logic::Scale { raw_low, raw_high, low, high } = logic::Scale::default();
        Settings { raw_low, raw_high, low, high }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { raw_low, raw_high, low, high } = settings;
        let scale = logic::Scale { raw_low, raw_high, low, high };
        scale.check()?;
        self.0 = scale;
        Ok(())
    }

    fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        let (out, out_of_range) = self.0.execute(inputs.raw);
        let quality = if out_of_range { Quality::Bad } else { Quality::Good };
        Outputs { out: RealSignal::new(out.value, quality), out_of_range }
    }
}
