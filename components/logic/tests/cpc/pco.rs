//! PCO: run order, interlocks, option modes and their table, dependents.

use crate::{expect, from_words, to_words};
use latchwork_logic::cpc::{Pco, PcoCommands, PcoInputs, PcoOutputs, PcoSettings, RestartRule};

/// Rule, inputs, option mode the logic wants, commands, option mode that comes out, what else must.
type Row<'a> = (&'a str, &'a str, u8, &'a str, u8, &'a str);

fn commands(words: &str) -> PcoCommands {
    let (modes, rest): (Vec<&str>, Vec<&str>) = words.split_whitespace().partition(|w| w.starts_with("mode"));
    let mut all = from_words!(rest.join(" "), PcoCommands::default();
        "auto" => orders.auto_mode, "manual" => orders.manual_mode, "forced" => orders.forced_mode,
        "on" => orders.on_order, "off" => orders.off_order,
        "ack" => interlocks.acknowledge, "restart" => interlocks.allow_restart,
        "dependents_auto" => dependents_auto);
    for mode in modes {
        all.option_modes |= 1 << (mode["mode".len()..].parse::<u8>().expect("a number") - 1);
    }
    all
}

fn words(out: &PcoOutputs) -> Vec<(&'static str, bool)> {
    let status = out.status;
    assert_eq!((out.run, out.interlocked, out.mode), (status.run, status.interlocked, status.mode));
    assert_eq!(out.mode, 1 << (out.option_mode - 1), "one bit");
    let mut words = to_words!(status; run auto_mode manual_mode forced_mode auto_order manual_order orders_differ
        interlocked start_interlock temporary_stop full_stop restart_needed unacknowledged io_error simulated
        option_mode_refused);
    words.push(("dependents_auto", out.dependents_auto));
    words
}

fn run(settings: PcoSettings, rows: &[Row<'_>]) {
    assert_eq!(settings.check(), Ok(()));
    let mut unit = Pco::default();
    for &(rule, given, auto_option_mode, command, option_mode, expected) in rows {
        let inputs = PcoInputs { auto_option_mode, ..PcoInputs::default() };
        let inputs = from_words!(given, inputs;
            "first" => first, "auto_on" => auto.auto_on, "auto_off" => auto.auto_off, "auto_request" => auto.auto_mode_request,
            "inhibit_forced" => auto.inhibit_forced, "dependents" => auto_dependents,
            "start" => interlocks.start, "temporary" => interlocks.temporary, "full" => interlocks.full,
            "io_error" => io_error, "simulated" => simulated);
        let out = unit.execute(&settings, inputs, commands(command));
        assert_eq!(out.option_mode, option_mode, "{rule}");
        expect(rule, expected, &words(&out));
    }
}

#[test]
fn orders_and_modes() {
    run(PcoSettings::default(), &[
        ("it begins in auto mode, stopped, in option mode 1", "", 0, "", 1, "auto_mode !run"),
        ("the logic starts it", "auto_on", 0, "", 1, "run auto_order"),
        ("going to manual moves nothing", "auto_on", 0, "manual", 1, "manual_mode run"),
        ("the operator stops it", "auto_on", 0, "off", 1, "!run orders_differ"),
        ("the request of the logic takes over", "auto_on auto_request", 0, "", 1, "auto_mode run"),
        ("forced", "auto_on", 0, "forced off", 1, "forced_mode !run"),
        ("the request does not end forced", "auto_on auto_request", 0, "", 1, "forced_mode !run"),
        ("inhibited, forced becomes auto", "auto_on inhibit_forced", 0, "", 1, "auto_mode run"),
        ("error and simulated are shown", "auto_on io_error simulated", 0, "", 1, "run io_error simulated"),
    ]);
}

#[test]
fn interlocks() {
    run(PcoSettings::default(), &[
        ("a start interlock prevents the start", "auto_on start", 0, "", 1, "!run interlocked start_interlock"),
        ("gone, it starts", "auto_on", 0, "", 1, "run !interlocked"),
        ("it stops nothing", "auto_on start", 0, "", 1, "run !interlocked start_interlock"),
        ("a temporary stop stops while it is there", "auto_on temporary", 0, "", 1, "!run interlocked temporary_stop"),
        ("and goes on by itself", "auto_on", 0, "ack", 1, "run !unacknowledged"),
        ("an acknowledgement hides nothing new", "auto_on full", 0, "ack", 1, "!run full_stop unacknowledged"),
        ("a full stop outlives its cause", "auto_on", 0, "", 1, "!run interlocked full_stop"),
        ("in forced mode too", "auto_on", 0, "forced on", 1, "forced_mode !run interlocked"),
        ("acknowledged, the operator's order of before is not kept", "auto_on", 0, "ack", 1, "!run !full_stop"),
        ("and an order given then is followed", "auto_on", 0, "on", 1, "run"),
    ]);
    run(PcoSettings { full_stop_restart: RestartRule::Command, ..PcoSettings::default() }, &[
        ("if so set, the restart must be allowed", "auto_on full", 0, "", 1, "!run restart_needed"),
        ("if so set, the restart must be allowed", "auto_on", 0, "ack", 1, "!run restart_needed"),
        ("if so set, the restart must be allowed", "auto_on", 0, "restart", 1, "run !restart_needed"),
    ]);
}

#[test]
fn full_stop_at_start() {
    let with = |full_stop_restart| PcoSettings { full_stop_restart, full_stop_at_start: true, ..PcoSettings::default() };
    run(with(RestartRule::Acknowledge), &[
        ("the unit does not start by itself", "first auto_on", 0, "ack", 1, "!run interlocked full_stop unacknowledged"),
        ("the unit does not start by itself", "auto_on", 0, "restart", 1, "!run full_stop !restart_needed"),
        ("in forced mode neither", "", 0, "forced on", 1, "!run full_stop"),
        ("acknowledged, an order is followed", "", 0, "ack on", 1, "run !full_stop !unacknowledged"),
    ]);
    run(with(RestartRule::Command), &[
        ("the restart is needed too", "first auto_on", 0, "", 1, "!run full_stop restart_needed unacknowledged"),
        ("an acknowledgement is not enough", "auto_on", 0, "ack", 1, "!run restart_needed !unacknowledged"),
        ("acknowledged and allowed", "auto_on", 0, "restart", 1, "run !full_stop"),
    ]);
    run(with(RestartRule::CommandEarly), &[
        ("early: also while a full stop is there", "first auto_on full", 0, "", 1, "!run restart_needed"),
        ("early: also while a full stop is there", "auto_on full", 0, "ack restart", 1, "!run full_stop !restart_needed"),
        ("early: also while a full stop is there", "auto_on", 0, "", 1, "run !full_stop"),
    ]);
    for rule in [RestartRule::Acknowledge, RestartRule::Command, RestartRule::CommandEarly] {
        run(with(rule), &[("a restored state goes on: nothing latches but at a first execution", "auto_on", 0, "", 1,
            "run !full_stop !restart_needed !unacknowledged")]);
    }
}

#[test]
fn option_modes() {
    // 2 ⇄ 3 → 4, and 4 leads nowhere.
    let allowed = [0, 0b0000_0100, 0b0000_1010, 0, 0, 0, 0, 0];
    run(PcoSettings { allowed, start_mode: 2, ..PcoSettings::default() }, &[
        ("it begins in the one that is set", "", 0, "", 2, "!option_mode_refused"),
        ("in auto the logic chooses", "", 3, "", 3, "!option_mode_refused"),
        ("none in particular leaves it", "", 0, "", 3, "!option_mode_refused"),
        ("the operator's choice counts for nothing there", "", 0, "mode2", 3, "!option_mode_refused"),
        ("what the table does not allow is refused", "", 5, "", 3, "option_mode_refused"),
        ("and stays so while it is wanted", "", 5, "", 3, "option_mode_refused"),
        ("until it is not wanted any more", "", 0, "", 3, "!option_mode_refused"),
        ("a mode that there is not is refused", "", 9, "", 3, "option_mode_refused"),
        ("the present one is never refused", "", 3, "", 3, "!option_mode_refused"),
        ("in manual the operator chooses", "", 3, "manual mode2", 2, "manual_mode"),
        ("the logic's choice counts for nothing there", "", 3, "", 2, "!option_mode_refused"),
        ("refused until another is wanted", "", 0, "mode4", 2, "option_mode_refused"),
        ("refused until another is wanted", "", 0, "", 2, "option_mode_refused"),
        ("of several the lowest is taken", "", 0, "mode3 mode4", 3, "!option_mode_refused"),
        ("in forced too", "", 0, "forced mode4", 4, "forced_mode"),
        ("from where nothing is allowed nothing goes", "", 0, "mode3", 4, "option_mode_refused"),
        ("back in auto the refusal is over", "", 0, "auto", 4, "auto_mode !option_mode_refused"),
    ]);
    run(PcoSettings { start_mode: 8, ..PcoSettings::default() }, &[
        ("by default every change is allowed", "", 1, "", 1, "!option_mode_refused"),
        ("by default every change is allowed", "", 8, "", 8, "!option_mode_refused"),
        ("it does not depend on running", "auto_on", 3, "", 3, "run"),
    ]);
}

#[test]
fn dependents() {
    run(PcoSettings::default(), &[
        ("nothing is commanded by itself", "", 0, "", 1, "!dependents_auto"),
        ("the operator's command lasts one execution", "", 0, "dependents_auto", 1, "dependents_auto"),
        ("the operator's command lasts one execution", "", 0, "", 1, "!dependents_auto"),
        ("a rising edge of the logic does the same", "dependents", 0, "", 1, "dependents_auto"),
        ("a rising edge of the logic does the same", "dependents", 0, "", 1, "!dependents_auto"),
    ]);
}
