//! OnOff of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};
use latchwork_sdk::flags;

#[derive(Default)]
struct OnOff {
    settings: cpc::OnOffSettings,
    actuator: cpc::OnOff,
}

#[latchwork_sdk::block("latchwork:device/on-off")]
impl OnOff {
    fn defaults() -> Settings {
        let logic = cpc::OnOffSettings::default();
        let cpc::OnOffSettings { fail_safe_on, has_feedback_on, has_feedback_off, full_stop_at_start, .. } = logic;
        let feedback_timeout = Duration::from_nanos(logic.feedback_timeout);
        let full_stop_restart = from_rule(logic.full_stop_restart);
        Settings {
            fail_safe_on,
            has_feedback_on,
            has_feedback_off,
            feedback_timeout,
            full_stop_restart,
            full_stop_at_start,
        }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { fail_safe_on, has_feedback_on, has_feedback_off, full_stop_at_start, .. } = settings;
        let settings = cpc::OnOffSettings {
            fail_safe_on,
            has_feedback_on,
            has_feedback_off,
            feedback_timeout: settings.feedback_timeout.ns,
            full_stop_restart: rule(settings.full_stop_restart),
            full_stop_at_start,
        };
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        let (orders, interlocks) = (order_commands(commands), interlock_commands(commands));
        let cpc::OnOffOutputs { output, on, off, interlocked, status } =
            self.actuator.execute(&self.settings, scan.elapsed, to_logic(scan.first, &inputs), orders, interlocks);
        let alarms = flags([
            (Alarms::START_INTERLOCK, status.start_interlock),
            (Alarms::TEMPORARY_STOP, status.temporary_stop),
            (Alarms::FULL_STOP, status.full_stop),
            (Alarms::POSITION_ALARM, status.position_alarm),
            (Alarms::IO_ERROR, status.io_error),
        ]);
        (Outputs { output, on, off, interlocked, status: register(status) }, alarms)
    }

    fn save(&self) -> Retained {
        let cpc::OnOff { orders, interlocks, started, feedback, position_alarm } = self.actuator;
        Retained {
            auto_mode: orders.mode == cpc::Mode::Auto,
            manual_mode: orders.mode == cpc::Mode::Manual,
            auto_mode_request: orders.auto_mode_request,
            auto_order: orders.auto,
            manual_order: orders.manual,
            start_interlock: interlocks.last.start,
            temporary_stop: interlocks.last.temporary,
            full_stop: interlocks.last.full,
            latched: interlocks.latched,
            restart_needed: interlocks.restart_needed,
            unacknowledged: interlocks.unacknowledged,
            started,
            output: feedback.order,
            differs: feedback.differs,
            differs_for: Duration::from_nanos(feedback.elapsed),
            position_alarm,
        }
    }

    fn restore(&mut self, state: Retained) {
        let (orders, interlocks) = (orders(&state), interlocks(&state));
        let Retained { started, output, differs, differs_for, position_alarm, .. } = state;
        let feedback = cpc::Supervision { order: output, differs, elapsed: differs_for.ns };
        self.actuator = cpc::OnOff { orders, interlocks, started, feedback, position_alarm };
    }
}

fn to_logic(first: bool, inputs: &Inputs) -> cpc::OnOffInputs {
    cpc::OnOffInputs {
        first,
        auto: mode_inputs(inputs),
        local: inputs.local,
        local_on: inputs.local_on,
        local_off: inputs.local_off,
        feedback_on: inputs.feedback_on,
        feedback_off: inputs.feedback_off,
        interlocks: interlock_inputs(inputs),
        io_error: inputs.io_error,
        simulated: inputs.simulated,
    }
}

fn register(status: cpc::OnOffStatus) -> StatusRegister {
    flags([
        (StatusRegister::ON, status.on),
        (StatusRegister::OFF, status.off),
        (StatusRegister::OUTPUT, status.output),
        (StatusRegister::AUTO_MODE, status.auto_mode),
        (StatusRegister::MANUAL_MODE, status.manual_mode),
        (StatusRegister::FORCED_MODE, status.forced_mode),
        (StatusRegister::LOCAL_MODE, status.local_mode),
        (StatusRegister::AUTO_ORDER, status.auto_order),
        (StatusRegister::MANUAL_ORDER, status.manual_order),
        (StatusRegister::ORDERS_DIFFER, status.orders_differ),
        (StatusRegister::INTERLOCKED, status.interlocked),
        (StatusRegister::START_INTERLOCK, status.start_interlock),
        (StatusRegister::TEMPORARY_STOP, status.temporary_stop),
        (StatusRegister::FULL_STOP, status.full_stop),
        (StatusRegister::RESTART_NEEDED, status.restart_needed),
        (StatusRegister::MOVING, status.moving),
        (StatusRegister::POSITION_ALARM, status.position_alarm),
        (StatusRegister::UNACKNOWLEDGED, status.unacknowledged),
        (StatusRegister::IO_ERROR, status.io_error),
        (StatusRegister::SIMULATED, status.simulated),
    ])
}

fn order_commands(commands: Commands) -> cpc::OrderCommands {
    cpc::OrderCommands {
        auto_mode: commands.contains(Commands::AUTO_MODE),
        manual_mode: commands.contains(Commands::MANUAL_MODE),
        forced_mode: commands.contains(Commands::FORCED_MODE),
        on_order: commands.contains(Commands::ON_ORDER),
        off_order: commands.contains(Commands::OFF_ORDER),
    }
}

fn interlock_commands(commands: Commands) -> cpc::InterlockCommands {
    cpc::InterlockCommands {
        acknowledge: commands.contains(Commands::ACKNOWLEDGE),
        allow_restart: commands.contains(Commands::ALLOW_RESTART),
    }
}

fn mode_inputs(inputs: &Inputs) -> cpc::ModeInputs {
    cpc::ModeInputs {
        auto_on: inputs.auto_on,
        auto_off: inputs.auto_off,
        auto_mode_request: inputs.auto_mode_request,
        inhibit_manual: inputs.inhibit_manual,
        inhibit_forced: inputs.inhibit_forced,
    }
}

fn interlock_inputs(inputs: &Inputs) -> cpc::InterlockInputs {
    cpc::InterlockInputs { start: inputs.start_interlock, temporary: inputs.temporary_stop, full: inputs.full_stop }
}

fn orders(state: &Retained) -> cpc::Orders {
    let mode = match (state.auto_mode, state.manual_mode) {
        (true, _) => cpc::Mode::Auto,
        (_, true) => cpc::Mode::Manual,
        _ => cpc::Mode::Forced,
    };
    let Retained { auto_mode_request, auto_order, manual_order, .. } = *state;
    cpc::Orders { mode, auto_mode_request, auto: auto_order, manual: manual_order }
}

fn interlocks(state: &Retained) -> cpc::Interlocks {
    let Retained { start_interlock, temporary_stop, full_stop, latched, restart_needed, unacknowledged, .. } = *state;
    let last = cpc::InterlockInputs { start: start_interlock, temporary: temporary_stop, full: full_stop };
    cpc::Interlocks { last, latched, restart_needed, unacknowledged }
}

fn rule(rule: RestartRule) -> cpc::RestartRule {
    match rule {
        RestartRule::Acknowledge => cpc::RestartRule::Acknowledge,
        RestartRule::Command => cpc::RestartRule::Command,
        RestartRule::CommandEarly => cpc::RestartRule::CommandEarly,
    }
}

fn from_rule(rule: cpc::RestartRule) -> RestartRule {
    match rule {
        cpc::RestartRule::Acknowledge => RestartRule::Acknowledge,
        cpc::RestartRule::Command => RestartRule::Command,
        cpc::RestartRule::CommandEarly => RestartRule::CommandEarly,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    #[test]
    fn a_restored_block_goes_on_like_the_one_it_was_saved_from() {
        let settings = Settings {
            has_feedback_on: true,
            feedback_timeout: Duration::from_nanos(3),
            full_stop_restart: RestartRule::Command,
            ..OnOff::defaults()
        };
        let configured = || {
            let mut block = OnOff::default();
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
        let rare = || next() % 8 == 0;
        let bit = || next() % 2 == 0;
        let mut block = configured();
        for step in 0..5_000 {
            let mut restored = configured();
            restored.restore(block.save());
            assert!(restored.actuator == block.actuator, "step {step}");
            let inputs = Inputs {
                auto_on: bit(),
                auto_off: rare(),
                auto_mode_request: rare(),
                inhibit_forced: rare(),
                local: rare(),
                local_on: bit(),
                local_off: rare(),
                feedback_on: bit(),
                start_interlock: rare(),
                temporary_stop: rare(),
                full_stop: rare(),
                ..Inputs::default()
            };
            let commands = Commands::from_bits_truncate((next() & next() & next()) as _);
            let scan = Scan { elapsed: next() % 3, ..Scan::default() };
            let (out, alarms) = block.execute(scan, inputs, commands);
            assert!(restored.execute(scan, inputs, commands) == (out, alarms), "step {step}");
        }
    }

    #[test]
    fn with_a_full_stop_at_start_a_block_that_faulted_waits_and_a_restored_one_goes_on() {
        let settings = Settings { full_stop_at_start: true, ..OnOff::defaults() };
        let configured = || {
            let mut block = OnOff::default();
            block.configure(settings).expect("accepted");
            block
        };
        let first = Scan { first: true, ..Scan::default() };
        let inputs = Inputs { auto_on: true, ..Inputs::default() };
        let mut block = configured();
        let (out, alarms) = block.execute(first, inputs, Commands::empty());
        assert!(!out.output && alarms.contains(Alarms::FULL_STOP), "the start of the plant");
        assert!(block.execute(Scan::default(), inputs, Commands::ACKNOWLEDGE).0.output, "acknowledged");

        let (out, alarms) = configured().execute(first, inputs, Commands::empty());
        assert!(!out.output && alarms.contains(Alarms::FULL_STOP), "a new instance after a fault");
        let mut restored = configured();
        restored.restore(block.save());
        let (out, alarms) = restored.execute(Scan::default(), inputs, Commands::empty());
        assert!(out.output && alarms.is_empty(), "a restored state");
    }
}
