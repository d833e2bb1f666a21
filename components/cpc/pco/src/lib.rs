//! Process control object (PCO) of UNICOS CPC, as a component.
#![no_std]

use latchwork_logic::{self as logic, cpc};
use latchwork_sdk::flags;

#[derive(Default)]
struct Pco {
    settings: cpc::PcoSettings,
    unit: cpc::Pco,
}

#[latchwork_sdk::block("latchwork:device/pco")]
impl Pco {
    fn defaults() -> Settings {
        let cpc::PcoSettings { allowed, start_mode, full_stop_restart, full_stop_at_start } =
            cpc::PcoSettings::default();
        let [allowed1, allowed2, allowed3, allowed4, allowed5, allowed6, allowed7, allowed8] =
            allowed.map(OptionModes::from_bits_truncate);
        let full_stop_restart = from_rule(full_stop_restart);
        Settings {
            allowed1,
            allowed2,
            allowed3,
            allowed4,
            allowed5,
            allowed6,
            allowed7,
            allowed8,
            start_mode,
            full_stop_restart,
            full_stop_at_start,
        }
    }

    fn configure(&mut self, settings: Settings) -> Result<(), logic::Refusal> {
        let Settings { allowed1, allowed2, allowed3, allowed4, allowed5, allowed6, allowed7, allowed8, .. } = settings;
        let allowed = [allowed1, allowed2, allowed3, allowed4, allowed5, allowed6, allowed7, allowed8];
        let settings = cpc::PcoSettings {
            allowed: allowed.map(|modes| modes.bits()),
            start_mode: settings.start_mode,
            full_stop_restart: rule(settings.full_stop_restart),
            full_stop_at_start: settings.full_stop_at_start,
        };
        settings.check()?;
        self.settings = settings;
        Ok(())
    }

    fn execute(&mut self, scan: Scan, inputs: Inputs, commands: Commands) -> (Outputs, Alarms) {
        let cpc::PcoOutputs { run, interlocked, option_mode, mode, dependents_auto, status } =
            self.unit.execute(&self.settings, to_logic(scan.first, &inputs), to_commands(commands));
        let alarms = flags([
            (Alarms::START_INTERLOCK, status.start_interlock),
            (Alarms::TEMPORARY_STOP, status.temporary_stop),
            (Alarms::FULL_STOP, status.full_stop),
            (Alarms::IO_ERROR, status.io_error),
        ]);
        let mode = OptionModes::from_bits_truncate(mode);
        let runs_in = |which| run && mode == which;
        let outputs = Outputs {
            run,
            interlocked,
            option_mode,
            mode,
            mode1: runs_in(OptionModes::MODE1),
            mode2: runs_in(OptionModes::MODE2),
            mode3: runs_in(OptionModes::MODE3),
            mode4: runs_in(OptionModes::MODE4),
            mode5: runs_in(OptionModes::MODE5),
            mode6: runs_in(OptionModes::MODE6),
            mode7: runs_in(OptionModes::MODE7),
            mode8: runs_in(OptionModes::MODE8),
            dependents_auto,
            status: register(status),
        };
        (outputs, alarms)
    }

    fn save(&self) -> Retained {
        let cpc::Pco { orders, interlocks, run, option_mode, refused, auto_dependents } = self.unit;
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
            run,
            option_mode,
            refused,
            auto_dependents,
        }
    }

    fn restore(&mut self, state: Retained) {
        let (orders, interlocks) = (orders(&state), interlocks(&state));
        let Retained { run, option_mode, refused, auto_dependents, .. } = state;
        self.unit = cpc::Pco { orders, interlocks, run, option_mode, refused, auto_dependents };
    }
}

fn to_logic(first: bool, inputs: &Inputs) -> cpc::PcoInputs {
    cpc::PcoInputs {
        first,
        auto: mode_inputs(inputs),
        auto_option_mode: inputs.auto_option_mode,
        auto_dependents: inputs.auto_dependents,
        interlocks: interlock_inputs(inputs),
        io_error: inputs.io_error,
        simulated: inputs.simulated,
    }
}

fn to_commands(commands: Commands) -> cpc::PcoCommands {
    let option = |command, mode| (mode, commands.contains(command));
    let option_modes: OptionModes = flags([
        option(Commands::MODE1, OptionModes::MODE1),
        option(Commands::MODE2, OptionModes::MODE2),
        option(Commands::MODE3, OptionModes::MODE3),
        option(Commands::MODE4, OptionModes::MODE4),
        option(Commands::MODE5, OptionModes::MODE5),
        option(Commands::MODE6, OptionModes::MODE6),
        option(Commands::MODE7, OptionModes::MODE7),
        option(Commands::MODE8, OptionModes::MODE8),
    ]);
    cpc::PcoCommands {
        orders: order_commands(commands),
        interlocks: interlock_commands(commands),
        option_modes: option_modes.bits(),
        dependents_auto: commands.contains(Commands::DEPENDENTS_AUTO),
    }
}

fn register(status: cpc::PcoStatus) -> StatusRegister {
    let in_mode = |mode: OptionModes| status.mode & mode.bits() != 0;
    flags([
        (StatusRegister::RUN, status.run),
        (StatusRegister::AUTO_MODE, status.auto_mode),
        (StatusRegister::MANUAL_MODE, status.manual_mode),
        (StatusRegister::FORCED_MODE, status.forced_mode),
        (StatusRegister::AUTO_ORDER, status.auto_order),
        (StatusRegister::MANUAL_ORDER, status.manual_order),
        (StatusRegister::ORDERS_DIFFER, status.orders_differ),
        (StatusRegister::INTERLOCKED, status.interlocked),
        (StatusRegister::START_INTERLOCK, status.start_interlock),
        (StatusRegister::TEMPORARY_STOP, status.temporary_stop),
        (StatusRegister::FULL_STOP, status.full_stop),
        (StatusRegister::RESTART_NEEDED, status.restart_needed),
        (StatusRegister::UNACKNOWLEDGED, status.unacknowledged),
        (StatusRegister::IO_ERROR, status.io_error),
        (StatusRegister::SIMULATED, status.simulated),
        (StatusRegister::OPTION_MODE_REFUSED, status.option_mode_refused),
        (StatusRegister::MODE1, in_mode(OptionModes::MODE1)),
        (StatusRegister::MODE2, in_mode(OptionModes::MODE2)),
        (StatusRegister::MODE3, in_mode(OptionModes::MODE3)),
        (StatusRegister::MODE4, in_mode(OptionModes::MODE4)),
        (StatusRegister::MODE5, in_mode(OptionModes::MODE5)),
        (StatusRegister::MODE6, in_mode(OptionModes::MODE6)),
        (StatusRegister::MODE7, in_mode(OptionModes::MODE7)),
        (StatusRegister::MODE8, in_mode(OptionModes::MODE8)),
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
        let settings =
            Settings { allowed2: OptionModes::MODE3, full_stop_restart: RestartRule::Command, ..Pco::defaults() };
        let configured = || {
            let mut block = Pco::default();
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
            assert!(restored.unit == block.unit, "step {step}");
            let inputs = Inputs {
                auto_on: bit(),
                auto_off: rare(),
                auto_mode_request: rare(),
                inhibit_forced: rare(),
                auto_option_mode: next() as u8 % 10,
                auto_dependents: rare(),
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
        let settings = Settings { full_stop_at_start: true, ..Pco::defaults() };
        let configured = || {
            let mut block = Pco::default();
            block.configure(settings).expect("accepted");
            block
        };
        let first = Scan { first: true, ..Scan::default() };
        let inputs = Inputs { auto_on: true, ..Inputs::default() };
        let mut block = configured();
        let (out, alarms) = block.execute(first, inputs, Commands::empty());
        assert!(!out.run && alarms.contains(Alarms::FULL_STOP), "the start of the plant");
        assert!(block.execute(Scan::default(), inputs, Commands::ACKNOWLEDGE).0.run, "acknowledged");

        let (out, alarms) = configured().execute(first, inputs, Commands::empty());
        assert!(!out.run && alarms.contains(Alarms::FULL_STOP), "a new instance after a fault");
        let mut restored = configured();
        restored.restore(block.save());
        let (out, alarms) = restored.execute(Scan::default(), inputs, Commands::empty());
        assert!(out.run && alarms.is_empty(), "a restored state");
    }
}
