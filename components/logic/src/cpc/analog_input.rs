//! CPC's AnalogInput (AI): a raw value scaled to its unit, filtered, with its quality and an operator's hold on it.

use super::{AnalogForce, AnalogForceCommands, range::Range};
use crate::{Quality, Refusal, Signal, refusal};

/// Settings of the input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalogInputSettings {
    /// Raw value that stands for `low`; finite.
    pub raw_low: f64,
    /// Raw value that stands for `high`; finite, above `raw_low`.
    pub raw_high: f64,
    /// Value at `raw_low`; finite.
    pub low: f64,
    /// Value at `raw_high`; finite, different from `low`, may be below it.
    pub high: f64,
    /// How far a raw value may lie outside its range, % of the range; finite, 0 or more.
    pub margin: f64,
    /// Smallest movement that changes the value, in its unit; finite, 0 or more.
    pub deadband: f64,
    /// Time constant of the first-order filter, ns; 0 is no filter.
    pub filter_time: u64,
    /// Value while forced; finite.
    pub forced_value: f64,
}

impl Default for AnalogInputSettings {
    /// The 15-bit word of an analogue input to 0 to 100.
    fn default() -> Self {
        Self {
            raw_low: 0.0,
            raw_high: 32_767.0,
            low: 0.0,
            high: 100.0,
            margin: 0.0,
            deadband: 0.0,
            filter_time: 0,
            forced_value: 0.0,
        }
    }
}

impl AnalogInputSettings {
    /// Refuses settings outside their ranges.
    pub fn check(&self) -> Result<(), Refusal> {
        self.range().check()?;
        refusal::not_negative("margin", self.margin)?;
        refusal::not_negative("deadband", self.deadband)?;
        refusal::finite("forced-value", self.forced_value)
    }

    fn range(&self) -> Range {
        let Self { raw_low, raw_high, low, high, .. } = *self;
        Range { raw_low, raw_high, low, high }
    }
}

/// What can be seen of the input.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnalogInputOutputs {
    /// The value: good while forced; bad and the last one believed during an I/O error.
    pub value: Signal,
    /// What the value would be if it were not forced.
    pub measured: f64,
    /// The status register.
    pub status: AnalogInputStatus,
}

/// The status register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AnalogInputStatus {
    /// The value follows the operator (FoMoSt).
    pub forced: bool,
    /// The raw value is bad, no number or out of range (IOErrorW).
    pub io_error: bool,
    /// The raw value is simulated (IOSimuW).
    pub simulated: bool,
    /// Forced away from what is measured by more than the dead band (FoDiProW).
    pub forced_differs: bool,
    /// The raw value is below its range.
    pub below_range: bool,
    /// The raw value is above its range.
    pub above_range: bool,
}

/// The input. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnalogInput {
    /// The operator's hold.
    pub force: AnalogForce,
    /// The filtered value; none before the first believed one and after an I/O error.
    pub filtered: Option<f64>,
    /// The value after the dead band; none before the first believed one.
    pub measured: Option<f64>,
}

impl AnalogInput {
    /// One execution, `elapsed` ns after the previous one.
    pub fn execute(
        &mut self,
        settings: &AnalogInputSettings,
        elapsed: u64,
        raw: Signal,
        simulated: bool,
        commands: AnalogForceCommands,
    ) -> AnalogInputOutputs {
        // Not the distance times the part: that of two finite numbers may be infinite, and infinite times 0 is no number.
        let part = settings.margin / 100.0;
        let margin = settings.raw_high * part - settings.raw_low * part;
        let below_range = raw.value < settings.raw_low - margin;
        let above_range = raw.value > settings.raw_high + margin;
        let io_error = !raw.is_usable() || below_range || above_range;
        let restarted = self.filtered.is_none();
        // An old value is not averaged with one from after an error.
        self.filtered = (!io_error).then(|| {
            let value = settings.range().to_value(raw.value);
            self.filtered.filter(|f| f.is_finite()).map_or(value, |f| filter(f, value, elapsed, settings.filter_time))
        });
        if let Some(filtered) = self.filtered {
            let near = self.measured.is_some_and(|m| (filtered - m).abs() < settings.deadband);
            if restarted || !near {
                self.measured = Some(filtered);
            }
        }
        let measured = self.measured.filter(|m| m.is_finite()).unwrap_or(0.0);
        let forced = self.force.execute(commands);
        let quality = if io_error { Quality::Bad } else { raw.quality };
        let value =
            if forced { Signal::new(settings.forced_value, Quality::Good) } else { Signal::new(measured, quality) };
        let status = AnalogInputStatus {
            forced,
            io_error,
            simulated,
            forced_differs: forced && (settings.forced_value - measured).abs() > settings.deadband,
            below_range,
            above_range,
        };
        AnalogInputOutputs { value, measured, status }
    }
}

/// One step of a first-order filter: implicit (backward Euler), so that no step however long overshoots.
fn filter(before: f64, input: f64, elapsed: u64, time: u64) -> f64 {
    if time == 0 {
        return input;
    }
    let part = elapsed as f64 / (elapsed as f64 + time as f64);
    before * (1.0 - part) + input * part
}
