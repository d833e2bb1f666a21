//! AnalogAlarm of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};
use latchwork_sdk::flags;

#[derive(Default)]
struct AnalogAlarm {
    settings: cpc::AnalogAlarmSettings,
    alarm: cpc::AnalogAlarm,
}

#[latchwork_sdk::block("latchwork:device/analog-alarm")]
impl AnalogAlarm {
    fn defaults() -> Settings {
        let logic = cpc::AnalogAlarmSettings::default();
        let cpc::Thresholds { hh, h, l, ll } = logic.limits;
        Settings {
            hh,
            h,
            l,
            ll,
            thresholds: to_flags(logic.used),
            hysteresis: logic.hysteresis,
            delay: Duration::from_nanos(logic.delay),
            interlock_on_io_error: logic.interlock_on_io_error,
        }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { hh, h, l, ll, thresholds, hysteresis, delay, interlock_on_io_error } = settings;
        let settings = cpc::AnalogAlarmSettings {
            limits: cpc::Thresholds { hh, h, l, ll },
            used: from_flags(thresholds),
            hysteresis,
            delay: delay.ns,
            interlock_on_io_error,
        };
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        let Inputs { value, disable_hh, disable_h, disable_l, disable_ll, auto_acknowledge, simulated } = inputs;
        let inputs = cpc::AnalogAlarmInputs {
            value: logic::Signal::new(value.value, quality(value.quality)),
            disable: cpc::Thresholds { hh: disable_hh, h: disable_h, l: disable_l, ll: disable_ll },
            auto_acknowledge,
            simulated,
        };
        let cpc::AnalogAlarmOutputs { interlock, warning, alarms, status } =
            self.alarm.execute(&self.settings, scan.elapsed, inputs, alarm_commands(commands));
        let alarms = flags([
            (Alarms::HH, alarms.hh),
            (Alarms::H, alarms.h),
            (Alarms::L, alarms.l),
            (Alarms::LL, alarms.ll),
            (Alarms::IO_ERROR, status.io_error),
        ]);
        (Outputs { interlock, warning, status: register(status) }, alarms)
    }

    fn save(&self) -> Retained {
        let cpc::AnalogAlarm { thresholds, io_error, alarms, interlock, blocked, unacknowledged } = self.alarm;
        let io_error = cpc::Threshold { beyond: false, delay: io_error };
        Retained {
            hh: to_state(thresholds.hh),
            h: to_state(thresholds.h),
            l: to_state(thresholds.l),
            ll: to_state(thresholds.ll),
            io_error: to_state(io_error),
            alarms: to_flags(alarms),
            interlock,
            blocked,
            unacknowledged,
        }
    }

    fn restore(&mut self, state: Retained) {
        let Retained { hh, h, l, ll, io_error, alarms, interlock, blocked, unacknowledged } = state;
        self.alarm = cpc::AnalogAlarm {
            thresholds: cpc::Thresholds { hh: from_state(hh), h: from_state(h), l: from_state(l), ll: from_state(ll) },
            io_error: from_state(io_error).delay,
            alarms: from_flags(alarms),
            interlock,
            blocked,
            unacknowledged,
        };
    }
}

fn to_state(threshold: cpc::Threshold) -> ThresholdState {
    let cpc::Threshold { beyond, delay } = threshold;
    ThresholdState { beyond, condition: delay.input, active: delay.q, stood_for: Duration::from_nanos(delay.et) }
}

fn from_state(state: ThresholdState) -> cpc::Threshold {
    let ThresholdState { beyond, condition, active, stood_for } = state;
    cpc::Threshold { beyond, delay: logic::Ton { input: condition, q: active, et: stood_for.ns } }
}

fn to_flags(all: cpc::Thresholds<bool>) -> Thresholds {
    flags([(Thresholds::HH, all.hh), (Thresholds::H, all.h), (Thresholds::L, all.l), (Thresholds::LL, all.ll)])
}

fn from_flags(flags: Thresholds) -> cpc::Thresholds<bool> {
    cpc::Thresholds {
        hh: flags.contains(Thresholds::HH),
        h: flags.contains(Thresholds::H),
        l: flags.contains(Thresholds::L),
        ll: flags.contains(Thresholds::LL),
    }
}

fn register(status: cpc::AnalogAlarmStatus) -> StatusRegister {
    flags([
        (StatusRegister::HH, status.active.hh),
        (StatusRegister::H, status.active.h),
        (StatusRegister::L, status.active.l),
        (StatusRegister::LL, status.active.ll),
        (StatusRegister::PENDING, status.pending),
        (StatusRegister::INTERLOCK, status.interlock),
        (StatusRegister::WARNING, status.warning),
        (StatusRegister::UNACKNOWLEDGED, status.unacknowledged),
        (StatusRegister::BLOCKED, status.blocked),
        (StatusRegister::IO_ERROR, status.io_error),
        (StatusRegister::SIMULATED, status.simulated),
        (StatusRegister::HH_ENABLED, status.enabled.hh),
        (StatusRegister::H_ENABLED, status.enabled.h),
        (StatusRegister::L_ENABLED, status.enabled.l),
        (StatusRegister::LL_ENABLED, status.enabled.ll),
    ])
}

fn alarm_commands(commands: Commands) -> cpc::AlarmCommands {
    cpc::AlarmCommands {
        acknowledge: commands.contains(Commands::ACKNOWLEDGE),
        block: commands.contains(Commands::BLOCK),
        unblock: commands.contains(Commands::UNBLOCK),
    }
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
        let settings = Settings { delay: Duration::from_nanos(3), hysteresis: 20.0, ..AnalogAlarm::defaults() };
        let configured = || {
            let mut block = AnalogAlarm::default();
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
        let real = || (next() % 130) as f64 - 10.0;
        let mut block = configured();
        for step in 0..5_000 {
            let mut restored = configured();
            restored.restore(block.save());
            assert!(restored.alarm == block.alarm, "step {step}");
            let inputs = Inputs {
                value: RealSignal::new(real(), quality(bit(), bit())),
                disable_hh: bit() && bit(),
                disable_l: bit() && bit(),
                auto_acknowledge: bit() && bit(),
                ..Inputs::default()
            };
            let commands = Commands::from_bits_truncate((next() & next() & next()) as _);
            let scan = Scan { elapsed: next() % 3, ..Scan::default() };
            let (out, alarms) = block.execute(scan, inputs, commands);
            assert!(restored.execute(scan, inputs, commands) == (out, alarms), "step {step}");
        }
    }
}
