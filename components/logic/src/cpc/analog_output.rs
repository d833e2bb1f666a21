//! CPC's AnalogOutput (AO): an order in its unit, held within its range and rate, scaled to the raw value of the field.

use super::{AnalogForce, AnalogForceCommands, range::Range};
use crate::{Refusal, Signal, refusal};

/// Settings of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalogOutputSettings {
    /// Value that `raw_low` stands for; finite.
    pub low: f64,
    /// Value that `raw_high` stands for; finite, different from `low`, may be below it.
    pub high: f64,
    /// Raw value at `low`; finite.
    pub raw_low: f64,
    /// Raw value at `high`; finite, above `raw_low`.
    pub raw_high: f64,
    /// Fastest movement of the position, unit/s; finite, 0 or more; 0 is no limit.
    pub rate_limit: f64,
    /// Position before the first usable order; finite, held at the end of the range it is beyond.
    pub start: f64,
    /// Position while forced; finite, held at the end of the range it is beyond.
    pub forced_value: f64,
}

impl Default for AnalogOutputSettings {
    fn default() -> Self {
        Self { low: 0.0, high: 100.0, raw_low: 0.0, raw_high: 32_767.0, rate_limit: 0.0, start: 0.0, forced_value: 0.0 }
    }
}

impl AnalogOutputSettings {
    /// Refuses settings outside their ranges.
    pub fn check(&self) -> Result<(), Refusal> {
        self.range().check()?;
        refusal::not_negative("rate-limit", self.rate_limit)?;
        // Held within the range where they are used: the defaults of both must do for a range that excludes 0.
        refusal::finite("start", self.start)?;
        refusal::finite("forced-value", self.forced_value)
    }

    fn range(&self) -> Range {
        let Self { low, high, raw_low, raw_high, .. } = *self;
        Range { raw_low, raw_high, low, high }
    }
}

/// What acts on the output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnalogOutputInputs {
    /// The position that is wanted, in its unit.
    pub order: Signal,
    /// The channel reports an error.
    pub io_error: bool,
    /// The channel is simulated.
    pub simulated: bool,
}

/// What the output does and shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnalogOutputOutputs {
    /// To the field, `raw_low` to `raw_high`.
    pub raw: f64,
    /// The position, between `low` and `high`.
    pub position: f64,
    /// The status register.
    pub status: AnalogOutputStatus,
}

/// The status register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AnalogOutputStatus {
    /// The position follows the operator (FoMoSt).
    pub forced: bool,
    /// The channel reports an error (IOErrorW).
    pub io_error: bool,
    /// The channel is simulated (IOSimuW).
    pub simulated: bool,
    /// Forced to something else than what is wanted (FoDiProW).
    pub forced_differs: bool,
    /// The order is bad or no number; the last one stands.
    pub order_invalid: bool,
    /// The order lies outside the range and is held at its end.
    pub limited: bool,
    /// The position is on its way, no faster than its rate.
    pub ramping: bool,
}

/// The output. The fields are the state that survives a restart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AnalogOutput {
    /// The operator's hold.
    pub force: AnalogForce,
    /// The last usable order; none before the first.
    pub order: Option<f64>,
    /// The position; none before the first execution.
    pub position: Option<f64>,
}

impl AnalogOutput {
    /// One execution, `elapsed` ns after the previous one. With settings that `check` accepts, position and raw value never
    /// leave their ranges.
    pub fn execute(
        &mut self,
        settings: &AnalogOutputSettings,
        elapsed: u64,
        inputs: AnalogOutputInputs,
        commands: AnalogForceCommands,
    ) -> AnalogOutputOutputs {
        let range = settings.range();
        let valid = inputs.order.is_usable();
        if valid {
            self.order = Some(inputs.order.value);
        }
        let start = range.clamp(settings.start);
        let order = self.order.unwrap_or(start);
        let forced = self.force.execute(commands);
        let target = range.clamp(if forced { settings.forced_value } else { order });
        let from = range.clamp(self.position.unwrap_or(start));
        let position = range.clamp(approach(from, target, settings.rate_limit, elapsed));
        self.position = Some(position);
        let status = AnalogOutputStatus {
            forced,
            io_error: inputs.io_error,
            simulated: inputs.simulated,
            forced_differs: forced && target != range.clamp(order),
            order_invalid: !valid,
            limited: range.clamp(order) != order,
            ramping: position != target,
        };
        let (raw_low, raw_high) = (settings.raw_low, settings.raw_high);
        AnalogOutputOutputs { raw: range.to_raw(position).max(raw_low).min(raw_high), position, status }
    }
}

/// From `from` towards `target`, by no more than `rate` per second; a rate of 0 is no limit.
fn approach(from: f64, target: f64, rate: f64, elapsed: u64) -> f64 {
    // Also false for a rate that is NaN.
    let limited = rate > 0.0;
    let step = rate * (elapsed as f64 / 1e9);
    if !limited || (target - from).abs() <= step {
        target
    } else if target > from {
        from + step
    } else {
        from - step
    }
}
