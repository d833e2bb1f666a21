//! DigitalAlarm of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};
use latchwork_sdk::flags;

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

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    #[test]
    fn a_restored_block_goes_on_like_the_one_it_was_saved_from() {
        let settings = Settings { delay: Duration::from_nanos(3), ..DigitalAlarm::defaults() };
        let configured = || {
            let mut block = DigitalAlarm::default();
            block.configure(settings).expect("accepted");
            block
        };
        let seed = Cell::new(0x2545_f491_4f6c_dd1d_u64);
        let next = || {
            let x = seed.get() ^ (seed.get() << 13);
            let x = x ^ (x >> 7);
            seed.set(x ^ (x << 17));
            seed.get() >> 20
        };
        let bit = || next() % 2 == 0;
        let quality = |a: bool, b: bool| if a && b { Quality::Bad } else { Quality::Good };
        let mut block = configured();
        for step in 0..5_000 {
            let mut restored = configured();
            restored.restore(block.save());
            assert!(restored.alarm == block.alarm, "step {step}");
            let inputs = Inputs {
                input: BoolSignal::new(bit() || bit(), quality(bit(), bit())),
                disable: bit() && bit(),
                auto_acknowledge: bit() && bit(),
                simulated: bit(),
            };
            let commands = Commands::from_bits_truncate((next() & next() & next()) as _);
            let scan = Scan { elapsed: next() % 3, ..Scan::default() };
            let (out, alarms) = block.execute(scan, inputs, commands);
            assert!(restored.execute(scan, inputs, commands) == (out, alarms), "step {step}");
        }
    }
}
