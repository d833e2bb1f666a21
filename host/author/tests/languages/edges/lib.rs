//! Whole numbers at their edges.

mod class;

use class::*;

const LEAST: Whole =
    Whole { b: 0, c: i8::MIN, d: 0, e: i16::MIN, f: 0, g: i32::MIN, h: 0, i: i64::MIN };
const MOST: Whole = Whole {
    b: u8::MAX, c: i8::MAX, d: u16::MAX, e: i16::MAX, f: u32::MAX, g: i32::MAX, h: u64::MAX, i: i64::MAX,
};

pub struct Block {
    settings: Whole,
    kept: Whole,
}

impl Default for Block {
    fn default() -> Self {
        Self { settings: LEAST, kept: LEAST }
    }
}

impl Block {
    pub fn configure(&mut self, settings: Settings) -> Result<(), String> {
        self.settings = settings.whole;
        Ok(())
    }

    pub fn execute(&mut self, _scan: Scan, inputs: Inputs) -> Outputs {
        let Whole { b, c, d, e, f, g, h, i } = inputs.whole;
        let upper = Upper {
            b: b > u8::MAX / 2,
            c: c < 0,
            d: d > u16::MAX / 2,
            e: e < 0,
            f: f > u32::MAX / 2,
            g: g < 0,
            h: h > u64::MAX / 2,
            i: i < 0,
        };
        let whole = match inputs.ask {
            Ask::Least => LEAST,
            Ask::Most => MOST,
            Ask::Settings => self.settings,
            Ask::Kept => self.kept,
            Ask::Echo | Ask::TooMuch => {
                self.kept = inputs.whole;
                self.kept
            }
        };
        Outputs { whole, upper }
    }

    pub fn save(&mut self) -> Retained {
        Retained { whole: self.kept }
    }

    pub fn restore(&mut self, state: Retained) {
        self.kept = state.whole;
    }
}
