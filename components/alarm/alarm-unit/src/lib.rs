//! Alarm unit for one analogue and one binary channel, as a component.
#![no_std]

use latchwork_logic as logic;

#[derive(Default)]
struct AlarmUnit {
    settings: logic::AlarmUnitSettings,
    unit: logic::AlarmUnit,
}

#[latchwork_sdk::block("latchwork:device/alarm-unit")]
impl AlarmUnit {
    fn defaults() -> Settings {
        let logic = logic::AlarmUnitSettings::default();
        Settings {
            pulse: Duration::from_nanos(logic.pulse),
            scale_low: logic.scale.low,
            scale_high: logic.scale.high,
            low_limit: logic.bounds.low_limit,
            high_limit: logic.bounds.high_limit,
            hysteresis: logic.bounds.hysteresis,
            veracity: logic.veracity,
            max_step: logic.analog.max_step,
            check_period: Duration::from_nanos(logic.analog.period),
            average: logic.analog.average,
            veracity_time: Duration::from_nanos(logic.veracity_time),
            on_time: Duration::from_nanos(logic.blink.on_time),
            off_time: Duration::from_nanos(logic.blink.off_time),
        }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { scale_low, scale_high, low_limit, high_limit, hysteresis, max_step, average, .. } = settings;
        let settings = logic::AlarmUnitSettings {
            pulse: settings.pulse.ns,
            scale: logic::Scale { low: scale_low, high: scale_high, ..logic::Scale::default() },
            bounds: logic::BoundsSettings { low_limit, high_limit, hysteresis },
            veracity: settings.veracity,
            analog: logic::AnalogSettings { max_step, period: settings.check_period.ns, average },
            veracity_time: settings.veracity_time.ns,
            blink: logic::MultivibratorSettings { on_time: settings.on_time.ns, off_time: settings.off_time.ns },
        };
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        let Inputs { level, door, offset, test } = inputs;
        let inputs = logic::AlarmUnitInputs { level, door, offset, test };
        let commands = logic::AlarmUnitCommands {
            acknowledge: commands.contains(Commands::ACKNOWLEDGE),
            silence: commands.contains(Commands::SILENCE),
            reset: commands.contains(Commands::RESET),
        };
        let logic::AlarmUnitOutputs { lamp, horn, value, violation, high, low, door, hardware_fault } =
            self.unit.execute(&self.settings, scan.elapsed, inputs, commands);

        let mut alarms = Alarms::empty();
        alarms.set(Alarms::HIGH, high);
        alarms.set(Alarms::LOW, low);
        alarms.set(Alarms::DOOR, door);
        alarms.set(Alarms::HARDWARE_FAULT, hardware_fault);
        let value = from_logic(value);
        (Outputs { lamp, horn, value, violation, high, low, door, hardware_fault }, alarms)
    }

    fn save(&self) -> Retained {
        let logic::AlarmUnitState { violation, silenced, high, low, door, live, accepted, hardware_fault } =
            self.unit.save();
        let (seeded, accepted) = (accepted.is_some(), accepted.unwrap_or_default());
        Retained { violation, silenced, high, low, door, live, seeded, accepted, hardware_fault }
    }

    fn restore(&mut self, state: Retained) {
        let Retained { violation, silenced, high, low, door, live, seeded, accepted, hardware_fault } = state;
        let accepted = seeded.then_some(accepted);
        let state = logic::AlarmUnitState { violation, silenced, high, low, door, live, accepted, hardware_fault };
        self.unit.restore(state);
    }
}

fn from_logic(signal: logic::Signal) -> RealSignal {
    let quality = match signal.quality {
        logic::Quality::Good => Quality::Good,
        logic::Quality::Uncertain => Quality::Uncertain,
        logic::Quality::Bad => Quality::Bad,
    };
    RealSignal::new(signal.value, quality)
}
