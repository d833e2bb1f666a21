//! DigitalAlarm of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};

#[derive(Default)]
struct DigitalAlarm {
    settings: cpc::DigitalAlarmSettings,
    alarm: cpc::DigitalAlarm,
}

#[latchwork_sdk::block("latchwork:device/digital-alarm")]
impl DigitalAlarm {
    fn defaults() -> Settings {
        let cpc::DigitalAlarmSettings { delay, alarm_on_io_error } = cpc::DigitalAlarmSettings::default();
        Settings { delay: Duration::from_nanos(delay), alarm_on_io_error }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { delay, alarm_on_io_error } = settings;
        self.settings = cpc::DigitalAlarmSettings { delay: delay.ns, alarm_on_io_error };
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        let Inputs { input, disable, auto_acknowledge, simulated } = inputs;
        let inputs = cpc::DigitalAlarmInputs { input: binary(input), disable, auto_acknowledge, simulated };
        let cpc::DigitalAlarmOutputs { interlock, status } =
            self.alarm.execute(&self.settings, scan.elapsed, inputs, alarm_commands(commands));
        let alarms = flags([(Alarms::ALARM, interlock), (Alarms::IO_ERROR, status.io_error)]);
        (Outputs { interlock, status: register(status) }, alarms)
    }

    fn save(&self) -> Retained {
        let cpc::DigitalAlarm { delay, blocked, interlock, unacknowledged } = self.alarm;
        let logic::Ton { input, q, et } = delay;
        let stood_for = Duration::from_nanos(et);
        Retained { condition: input, active: q, stood_for, blocked, interlock, unacknowledged }
    }

    fn restore(&mut self, state: Retained) {
        let Retained { condition, active, stood_for, blocked, interlock, unacknowledged } = state;
        let delay = logic::Ton { input: condition, q: active, et: stood_for.ns };
        self.alarm = cpc::DigitalAlarm { delay, blocked, interlock, unacknowledged };
    }
}

fn register(status: cpc::DigitalAlarmStatus) -> StatusRegister {
    flags([
        (StatusRegister::INPUT, status.input),
        (StatusRegister::PENDING, status.pending),
        (StatusRegister::ACTIVE, status.active),
        (StatusRegister::INTERLOCK, status.interlock),
        (StatusRegister::UNACKNOWLEDGED, status.unacknowledged),
        (StatusRegister::BLOCKED, status.blocked),
        (StatusRegister::ENABLED, status.enabled),
        (StatusRegister::IO_ERROR, status.io_error),
        (StatusRegister::SIMULATED, status.simulated),
    ])
}

/// The flags whose condition holds.
fn flags<T: FromIterator<T>, const N: usize>(all: [(T, bool); N]) -> T {
    all.into_iter().filter(|(_, holds)| *holds).map(|(flag, _)| flag).collect()
}

fn alarm_commands(commands: Commands) -> cpc::AlarmCommands {
    cpc::AlarmCommands {
        acknowledge: commands.contains(Commands::ACKNOWLEDGE),
        block: commands.contains(Commands::BLOCK),
        unblock: commands.contains(Commands::UNBLOCK),
    }
}

fn binary(signal: BoolSignal) -> cpc::Binary {
    cpc::Binary::new(signal.value, quality(signal.quality))
}

fn quality(quality: Quality) -> logic::Quality {
    match quality {
        Quality::Good => logic::Quality::Good,
        Quality::Uncertain => logic::Quality::Uncertain,
        Quality::Bad => logic::Quality::Bad,
    }
}
