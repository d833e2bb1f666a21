//! Model of an open tank with pump, drain and level transmitter, for plants without their hardware.

use crate::{Refusal, refusal};

/// Settings of the tank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TankSettings {
    /// Height of the rim, m; finite, above 0.
    pub height: f64,
    /// Area of the floor, m²; finite, above 0.
    pub area: f64,
    /// Flow of the running pump, m³/s; finite, 0 or more.
    pub inflow: f64,
    /// Flow through the open drain at a full tank, m³/s; finite, 0 or more.
    pub outflow: f64,
    /// Flow that always leaves at a full tank, m³/s; finite, 0 or more.
    pub leak: f64,
    /// Level at a cold start, m; 0 to `height`.
    pub start: f64,
}

impl Default for TankSettings {
    fn default() -> Self {
        Self { height: 6.0, area: 1.0, inflow: 0.4, outflow: 0.6, leak: 0.0, start: 3.0 }
    }
}

impl TankSettings {
    /// Refuses settings outside their ranges.
    pub fn check(&self) -> Result<(), Refusal> {
        refusal::above_zero("height", self.height)?;
        refusal::above_zero("area", self.area)?;
        refusal::not_negative("inflow", self.inflow)?;
        refusal::not_negative("outflow", self.outflow)?;
        refusal::not_negative("leak", self.leak)?;
        refusal::not_negative("start", self.start)?;
        if self.start > self.height {
            return Err(Refusal::related(("start", self.start), "at most", ("height", self.height)));
        }
        Ok(())
    }
}

/// What acts on the tank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TankInputs {
    /// The pump runs.
    pub pump: bool,
    /// The drain is open.
    pub drain: bool,
    /// The transmitter's line is broken: the word is 0, whatever else disturbs it.
    pub line_break: bool,
    /// The transmitter is disturbed: the word is 32 767.
    pub spike: bool,
}

/// What can be seen of the tank.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TankOutputs {
    /// The transmitter's word: 0 at empty, 32 767 at the rim.
    pub level: u16,
    /// The true level, m, 0 to `height`.
    pub level_m: f64,
    /// The volume, m³.
    pub volume: f64,
    /// The level is at the rim.
    pub full: bool,
    /// The tank is empty.
    pub empty: bool,
}

/// The tank.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tank {
    /// The true level, m; none before the first execution, which takes the setting `start`. Survives a restart.
    pub level: Option<f64>,
}

impl Tank {
    /// One execution, `elapsed` ns after the previous one.
    pub fn execute(&mut self, settings: &TankSettings, elapsed: u64, inputs: TankInputs) -> TankOutputs {
        let height = settings.height;
        let within = |level: f64| level.max(0.0).min(height);
        let before = within(self.level.filter(|l| l.is_finite()).unwrap_or(settings.start));
        let level_m = within(settings.after(before, elapsed, inputs));
        self.level = Some(level_m);
        let level = match inputs {
            TankInputs { line_break: true, .. } => 0,
            TankInputs { spike: true, .. } => 32_767,
            _ => (level_m / height * 32_767.0 + 0.5) as u16,
        };
        let volume = level_m * settings.area;
        TankOutputs { level, level_m, volume, full: level_m >= height, empty: level_m <= 0.0 }
    }
}

impl TankSettings {
    /// The level `elapsed` ns later: A·dh/dt = inflow − outflow·√(h/H), Torricelli's law with flows given at a full tank.
    ///
    /// One implicit (backward Euler) step. With u = √(h/H) it is the quadratic u² + b·u = c, so it needs no iteration and
    /// neither overshoots nor oscillates however long the step is.
    fn after(&self, level: f64, elapsed: u64, inputs: TankInputs) -> f64 {
        if elapsed == 0 {
            return level;
        }
        let seconds = elapsed as f64 / 1e9;
        let inflow = if inputs.pump { self.inflow } else { 0.0 };
        let outflow = self.leak + if inputs.drain { self.outflow } else { 0.0 };
        let filled = level + seconds * inflow / self.area;
        if outflow <= 0.0 {
            return filled;
        }
        let b = seconds * outflow / (self.area * self.height);
        let c = filled / self.height;
        let u = 2.0 * c / (b + square_root(b * b + 4.0 * c));
        // Flows so large that both sides overflow: the pump's wins.
        if u.is_nan() { filled } else { self.height * u * u }
    }
}

/// √x for x ≥ 0: `core` has none. Halving the exponent is within 6 %, and every step of Newton's doubles the digits.
fn square_root(x: f64) -> f64 {
    if x < f64::MIN_POSITIVE || !x.is_finite() {
        return if x < f64::MIN_POSITIVE { 0.0 } else { x };
    }
    let mut root = f64::from_bits((x.to_bits() >> 1).saturating_add(0x1ff8_0000_0000_0000));
    for _ in 0..5 {
        root = 0.5 * (root + x / root);
    }
    root
}
