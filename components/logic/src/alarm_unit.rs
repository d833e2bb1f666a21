//! The alarm unit for one analogue and one binary channel (alarm unit, figure 14), composed of the other blocks' logic.
//!
//! ```text
//! level ─ scale ─ analogue veracity ─(+ offset)─ bounds ─┬ high ─ TP ┐
//!                        └ hardware fault: freezes ──┘   └ low ── TP ┼─ OR ─ RS ─┬─ multivibrator ─ lamp
//! door ── digital veracity ───────────────────────────────────── TP ┘    │      └─ AND NOT silenced ─ horn
//!                                                       acknowledge ─────┘
//! ```
//! Where it is stricter than the paper:
//! - A hardware fault freezes the bounds check instead of masking its result: a spike that passes while the value is
//!   too high would otherwise end and begin the violation again, and a fault would have raised a process alarm.
//! - High and low have a pulse each, and each violation a full one: one that comes back during its pulse, or a value that
//!   goes from one side to the other in one scan, is a new violation.

use crate::{
    AnalogSettings, AnalogState, AnalogVeracity, BoundsCheck, BoundsSettings, DigitalState, DigitalVeracity,
    Multivibrator, MultivibratorSettings, Quality, Refusal, Rs, Scale, Signal, Tp, refusal,
};

/// Settings of the alarm unit: those of its parts, and its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlarmUnitSettings {
    /// Length of the pulse that sets the violation flag, ns; above 0.
    pub pulse: u64,
    /// The analogue channel's scaling.
    pub scale: Scale,
    /// The analogue channel's limits.
    pub bounds: BoundsSettings,
    /// Whether the analogue channel is checked for veracity (ON).
    pub veracity: bool,
    /// The analogue channel's veracity check.
    pub analog: AnalogSettings,
    /// How long the binary channel must stand before it is believed (Time12), ns.
    pub veracity_time: u64,
    /// The lamp's blinking.
    pub blink: MultivibratorSettings,
}

impl Default for AlarmUnitSettings {
    fn default() -> Self {
        Self {
            pulse: 200_000_000,
            scale: Scale::default(),
            bounds: BoundsSettings::default(),
            veracity: true,
            analog: AnalogSettings::default(),
            veracity_time: 100_000_000,
            blink: MultivibratorSettings::default(),
        }
    }
}

impl AlarmUnitSettings {
    /// Refuses settings outside their ranges.
    pub fn check(&self) -> Result<(), Refusal> {
        refusal::some_time("pulse", self.pulse)?;
        refusal::finite("scale-low", self.scale.low)?;
        refusal::finite("scale-high", self.scale.high)?;
        if self.scale.low == self.scale.high {
            let (low, high) = (("scale-low", self.scale.low), ("scale-high", self.scale.high));
            return Err(Refusal::related(high, "different from", low));
        }
        self.bounds.check()?;
        self.analog.check()?;
        self.blink.check()
    }
}

/// What comes from the field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AlarmUnitInputs {
    /// The raw word of the analogue channel, 0 to 32 767; above is a hardware fault.
    pub level: u16,
    /// The binary channel; true is the abnormal state.
    pub door: bool,
    /// Trim added to the checked value; one that is not finite is a hardware fault.
    pub offset: f64,
    /// Lamp and horn test.
    pub test: bool,
}

/// What comes from the operator, each for one execution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AlarmUnitCommands {
    /// Resets the violation flag, unless its pulse still runs.
    pub acknowledge: bool,
    /// Mutes the horn until the next violation.
    pub silence: bool,
    /// Accepts the present word as the new reference of the veracity check.
    pub reset: bool,
}

/// What the alarm unit says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AlarmUnitOutputs {
    /// The lamp.
    pub lamp: bool,
    /// The horn.
    pub horn: bool,
    /// The value: uncertain while held because of a hardware fault, bad when there is none to hold.
    pub value: Signal,
    /// The violation flag.
    pub violation: bool,
    /// Above the high limit.
    pub high: bool,
    /// Below the low limit.
    pub low: bool,
    /// The checked binary channel.
    pub door: bool,
    /// The analogue channel is not believed.
    pub hardware_fault: bool,
}

/// The alarm unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AlarmUnit {
    live: bool,
    analog: AnalogVeracity,
    /// The last offset that could be used.
    offset: f64,
    hardware_fault: bool,
    bounds: BoundsCheck,
    door: DigitalVeracity,
    /// Of high, low and door.
    pulses: [Tp; 3],
    flag: Rs,
    silenced: bool,
    blink: Multivibrator,
}

/// What survives a restart: what the operator sees, and the references of the checks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AlarmUnitState {
    /// The violation flag.
    pub violation: bool,
    /// The horn was silenced.
    pub silenced: bool,
    /// Above the high limit.
    pub high: bool,
    /// Below the low limit.
    pub low: bool,
    /// The checked binary channel.
    pub door: bool,
    /// A word other than 0 has been seen.
    pub live: bool,
    /// The last accepted value without the offset, if any.
    pub accepted: Option<f64>,
    /// Whether the analogue channel was at fault.
    pub hardware_fault: bool,
}

impl AlarmUnit {
    /// One execution, `elapsed` ns after the previous one.
    pub fn execute(
        &mut self,
        settings: &AlarmUnitSettings,
        elapsed: u64,
        inputs: AlarmUnitInputs,
        commands: AlarmUnitCommands,
    ) -> AlarmUnitOutputs {
        let value = self.analog(settings, elapsed, inputs, commands.reset);
        let (high, low) = (self.bounds.high.q1, self.bounds.low.q1);
        let door = self.door.execute(elapsed, inputs.door, settings.veracity_time);

        let (mut begins, mut pulse) = (false, false);
        for (tp, violated) in self.pulses.iter_mut().zip([high, low, door]) {
            if violated && !tp.input {
                // Also one that comes back while its last pulse runs, which a TP alone would not see.
                (begins, *tp) = (true, Tp::default());
            }
            pulse |= tp.execute(elapsed, violated, settings.pulse.max(1));
        }
        // The flip-flop is reset dominant: without the pulse in its reset, an acknowledgement during the pulse would make
        // the flag, the lamp and the horn flicker for one scan.
        let violation = self.flag.execute(pulse, commands.acknowledge && !pulse);
        self.silenced = (self.silenced || commands.silence) && violation && !begins;

        let blink = self.blink.execute(&settings.blink, elapsed, violation);
        let hardware_fault = self.hardware_fault;
        let lamp = blink || inputs.test;
        let horn = (violation && !self.silenced) || inputs.test;
        AlarmUnitOutputs { lamp, horn, value, violation, high, low, door, hardware_fault }
    }

    /// The analogue channel as far as the bounds check; returns the value.
    fn analog(&mut self, settings: &AlarmUnitSettings, elapsed: u64, inputs: AlarmUnitInputs, reset: bool) -> Signal {
        // A driver that has not read yet shows 0: were that held as a reference, the first real word would be a spike.
        if reset || !self.live {
            self.analog.reset();
        }
        self.live |= inputs.level != 0;

        let (raw, _) = Scale { raw_low: 0, raw_high: 32_767, ..settings.scale }.execute(inputs.level);
        let (_, error) = self.analog.execute(&settings.analog, elapsed, settings.veracity, raw);
        let held = self.analog.held(&settings.analog);
        let trims = (held.unwrap_or(0.0) + inputs.offset).is_finite();
        if trims {
            self.offset = inputs.offset;
        }
        self.hardware_fault = error || !trims;
        let Some(held) = held else { return Signal::new(0.0, Quality::Bad) };
        let value = (held + self.offset).clamp(f64::MIN, f64::MAX);
        if self.hardware_fault {
            return Signal::new(value, Quality::Uncertain);
        }
        self.bounds.execute(&settings.bounds, value);
        Signal::new(value, Quality::Good)
    }

    /// The state to carry over.
    #[must_use]
    pub fn save(&self) -> AlarmUnitState {
        AlarmUnitState {
            violation: self.flag.q1,
            silenced: self.silenced,
            high: self.bounds.high.q1,
            low: self.bounds.low.q1,
            door: self.door.save().dout,
            live: self.live,
            accepted: self.analog.save().accepted,
            hardware_fault: self.hardware_fault,
        }
    }

    /// Goes on from a saved state. What was violated then is not violated anew; pulses and the lamp's phase start anew.
    pub fn restore(&mut self, state: AlarmUnitState) {
        let AlarmUnitState { violation, silenced, high, low, door, live, accepted, hardware_fault } = state;
        *self = Self { live, hardware_fault, silenced, flag: Rs { q1: violation }, ..Self::default() };
        self.bounds = BoundsCheck { high: Rs { q1: high }, low: Rs { q1: low } };
        self.analog.restore(AnalogState { accepted, error: hardware_fault });
        self.door.restore(DigitalState { dout: door, din: door, held: 0 });
        self.pulses = [high, low, door].map(|input| Tp { input, ..Tp::default() });
    }
}
