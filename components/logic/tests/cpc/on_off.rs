//! OnOff: modes, orders, interlocks, feedbacks, and who wins over whom.

use crate::{MS, Row, expect, from_words, to_words};
use latchwork_logic::cpc::{
    InterlockCommands, OnOff, OnOffInputs, OnOffOutputs, OnOffSettings, OrderCommands, RestartRule,
};

#[derive(Default)]
struct Commands {
    orders: OrderCommands,
    interlocks: InterlockCommands,
}

fn inputs(words: &str) -> OnOffInputs {
    from_words!(words, OnOffInputs::default();
        "first" => first, "auto_on" => auto.auto_on, "auto_off" => auto.auto_off, "auto_request" => auto.auto_mode_request,
        "inhibit_manual" => auto.inhibit_manual, "inhibit_forced" => auto.inhibit_forced,
        "local" => local, "local_on" => local_on, "local_off" => local_off,
        "feedback_on" => feedback_on, "feedback_off" => feedback_off,
        "start" => interlocks.start, "temporary" => interlocks.temporary, "full" => interlocks.full,
        "io_error" => io_error, "simulated" => simulated)
}

fn commands(words: &str) -> Commands {
    from_words!(words, Commands::default();
        "auto" => orders.auto_mode, "manual" => orders.manual_mode, "forced" => orders.forced_mode,
        "on" => orders.on_order, "off" => orders.off_order,
        "ack" => interlocks.acknowledge, "restart" => interlocks.allow_restart)
}

fn words(out: &OnOffOutputs) -> Vec<(&'static str, bool)> {
    let OnOffOutputs { output, on, off, interlocked, status } = *out;
    let same = (status.output, status.on, status.off, status.interlocked);
    assert_eq!((output, on, off, interlocked), same, "they are in the register");
    to_words!(status; on off output auto_mode manual_mode forced_mode local_mode auto_order manual_order orders_differ
        interlocked start_interlock temporary_stop full_stop restart_needed moving position_alarm unacknowledged
        io_error simulated)
}

fn run(settings: OnOffSettings, rows: &[Row<'_>]) {
    assert_eq!(settings.check(), Ok(()));
    let mut actuator = OnOff::default();
    for &(rule, ms, given, command, expected) in rows {
        let Commands { orders, interlocks } = commands(command);
        expect(rule, expected, &words(&actuator.execute(&settings, ms * MS, inputs(given), orders, interlocks)));
    }
}

fn with(full_stop_restart: RestartRule) -> OnOffSettings {
    OnOffSettings { full_stop_restart, ..OnOffSettings::default() }
}

#[test]
fn auto_mode() {
    run(OnOffSettings::default(), &[
        ("it begins in auto mode, off", 0, "", "", "auto_mode !output off !on !auto_order"),
        ("the logic orders on", 10, "auto_on", "", "output on !off auto_order"),
        ("the order stays", 10, "", "", "output auto_order"),
        ("the logic orders off", 10, "auto_off", "", "!output off"),
        ("off wins over on", 10, "auto_on auto_off", "", "!output"),
        ("the operator's orders count for nothing", 10, "", "on", "!output !manual_order"),
        ("the operator's orders count for nothing", 10, "auto_on", "off", "output"),
        ("error and simulated are shown", 10, "io_error simulated", "", "output io_error simulated"),
    ]);
}

#[test]
fn manual_and_forced_mode() {
    run(OnOffSettings::default(), &[
        ("going to manual moves nothing", 0, "auto_on", "", "output"),
        ("going to manual moves nothing", 10, "auto_on", "manual", "manual_mode !auto_mode output manual_order"),
        ("the operator orders off", 10, "auto_on", "off", "!output auto_order !manual_order orders_differ"),
        ("the order stays", 10, "auto_on", "", "!output"),
        ("the operator orders on", 10, "auto_off", "on", "output !auto_order orders_differ"),
        ("off wins over on", 10, "", "on off", "!output"),
        ("an order in the execution of the mode counts", 10, "", "manual on", "output"),
        ("the request of the logic takes over", 10, "auto_off auto_request", "", "auto_mode !output"),
        ("a request that stands is no new one", 10, "auto_request", "manual", "manual_mode"),
        ("a request that stands is no new one", 10, "auto_request", "", "manual_mode"),
        ("forced", 10, "", "forced on", "forced_mode !manual_mode output"),
        ("the request of the logic does not end forced", 10, "auto_request", "", "forced_mode output"),
        ("forced goes to manual as it is", 10, "", "manual", "manual_mode output"),
        ("the operator goes back to auto", 10, "", "auto", "auto_mode !output"),
        ("auto wins over manual and forced", 10, "", "auto manual forced", "auto_mode"),
        ("manual wins over forced", 10, "", "manual forced", "manual_mode"),
        ("the operator's mode wins over a request of that moment", 10, "auto_request", "manual", "manual_mode"),
        ("an inhibited manual mode becomes auto", 10, "inhibit_manual", "", "auto_mode"),
        ("and is not entered", 10, "inhibit_manual", "manual", "auto_mode"),
        ("forced is inhibited by itself", 10, "inhibit_manual", "forced", "forced_mode"),
        ("an inhibited forced mode becomes auto", 10, "inhibit_forced", "", "auto_mode"),
        ("and is not entered", 10, "inhibit_forced", "forced", "auto_mode"),
    ]);
}

#[test]
fn local_mode() {
    run(OnOffSettings::default(), &[
        ("in local the panel orders", 0, "local local_on auto_off", "", "local_mode !auto_mode output orders_differ"),
        ("the panel's order stays", 10, "local", "", "output"),
        ("off wins over on", 10, "local local_on local_off", "", "!output"),
        ("modes and orders of the operator count for nothing", 10, "local", "forced on", "local_mode !forced_mode !output"),
        ("a request during local is gone", 10, "local auto_request local_on", "", "local_mode output"),
        ("after local the mode is the one before", 10, "auto_off", "", "auto_mode !output"),
        ("from manual, what the panel ordered goes on", 10, "", "manual", "manual_mode !output"),
        ("from manual, what the panel ordered goes on", 10, "local local_on", "", "output"),
        ("from manual, what the panel ordered goes on", 10, "", "", "manual_mode output"),
    ]);
}

#[test]
fn start_interlock() {
    run(OnOffSettings::default(), &[
        ("it prevents a start", 0, "auto_on start", "", "!output interlocked start_interlock unacknowledged"),
        ("gone, the order is followed", 10, "auto_on", "", "output !interlocked unacknowledged"),
        ("it stops nothing", 10, "auto_on start", "ack", "output !interlocked start_interlock unacknowledged"),
        ("acknowledged", 10, "auto_on start", "ack", "output !unacknowledged"),
        ("once off, it stays off", 10, "auto_off start", "", "!output"),
        ("once off, it stays off", 10, "auto_on start", "", "!output interlocked"),
        ("in manual mode too", 10, "start", "manual on", "!output interlocked"),
        ("in forced mode too", 10, "start", "forced on", "!output interlocked"),
        ("in local mode too", 10, "start local local_on", "", "!output interlocked"),
    ]);
}

#[test]
fn temporary_stop() {
    run(OnOffSettings::default(), &[
        ("it stops while it is there", 0, "auto_on", "", "output"),
        ("it stops while it is there", 10, "auto_on temporary", "", "!output interlocked temporary_stop unacknowledged"),
        ("it starts again by itself", 10, "auto_on", "", "output !interlocked unacknowledged"),
        ("acknowledged", 10, "auto_on", "ack", "output !unacknowledged"),
        ("an acknowledgement hides no new one", 10, "auto_on temporary", "ack", "!output unacknowledged"),
        ("a start interlock of that time keeps it stopped", 10, "auto_on start", "", "!output interlocked"),
        ("a remembered order goes on too", 10, "auto_on", "", "output"),
        ("a remembered order goes on too", 10, "temporary", "", "!output auto_order"),
        ("a remembered order goes on too", 10, "", "", "output"),
        ("an order given meanwhile is followed afterwards", 10, "temporary", "manual off", "!output"),
        ("an order given meanwhile is followed afterwards", 10, "temporary", "on", "!output manual_order"),
        ("an order given meanwhile is followed afterwards", 10, "", "", "output"),
        ("in manual mode", 10, "temporary", "", "!output"),
        ("in forced mode", 10, "temporary", "forced on", "forced_mode !output interlocked"),
        ("in local mode", 10, "temporary local local_on", "", "local_mode !output interlocked"),
    ]);
}

#[test]
fn full_stop_until_acknowledged() {
    run(with(RestartRule::Acknowledge), &[
        ("it stops", 0, "auto_on", "", "output"),
        ("it stops", 10, "auto_on full", "", "!output interlocked full_stop unacknowledged !restart_needed"),
        ("gone, it still stops", 10, "auto_on", "", "!output interlocked full_stop unacknowledged"),
        ("acknowledged, the standing order of the logic is followed", 10, "auto_on", "ack", "output !full_stop !unacknowledged"),
        ("an acknowledgement hides no new one", 10, "auto_on full", "ack", "!output unacknowledged"),
        ("an acknowledgement hides no new one", 10, "auto_on", "", "!output full_stop unacknowledged"),
        ("acknowledged, and there again", 10, "auto_on full", "ack", "!output full_stop unacknowledged"),
        ("acknowledged while it is there, it still stops", 10, "auto_on full", "ack", "!output full_stop !unacknowledged"),
        ("and lets go when it is gone", 10, "auto_on", "", "output !full_stop"),
    ]);
}

#[test]
fn orders_after_a_full_stop() {
    run(with(RestartRule::Acknowledge), &[
        ("a remembered order of the logic ends", 0, "auto_on", "", "output"),
        ("a remembered order of the logic ends", 10, "full", "", "!output !auto_order"),
        ("a remembered order of the logic ends", 10, "", "ack", "!output !full_stop !interlocked"),
        ("the operator's order ends", 10, "", "manual on", "output"),
        ("the operator's order ends", 10, "full", "", "!output !manual_order"),
        ("one given meanwhile is not kept", 10, "", "on", "!output !manual_order"),
        ("one given with the acknowledgement is", 10, "", "ack on", "output"),
        ("the panel's order ends", 10, "local local_on", "", "output"),
        ("the panel's order ends", 10, "local full", "", "!output"),
        ("the panel's order ends", 10, "local", "ack", "!output !interlocked"),
        ("an order of the logic that ends with the stop is not kept", 10, "auto_on full", "auto", "!output auto_order"),
        ("an order of the logic that ends with the stop is not kept", 10, "auto_on", "", "!output auto_order"),
        ("an order of the logic that ends with the stop is not kept", 10, "", "ack", "!output !auto_order !full_stop"),
    ]);
}

#[test]
fn full_stop_until_the_restart_is_allowed() {
    run(with(RestartRule::Command), &[
        ("it stops", 0, "auto_on full", "", "!output full_stop restart_needed unacknowledged"),
        ("the command before the acknowledgement counts for nothing", 10, "auto_on", "restart", "restart_needed !output"),
        ("an acknowledgement is not enough", 10, "auto_on", "ack", "!output full_stop restart_needed !unacknowledged"),
        ("the command while it is there again counts for nothing", 10, "auto_on full", "restart", "restart_needed unacknowledged"),
        ("the command while it is there counts for nothing", 10, "auto_on full", "ack restart", "restart_needed !unacknowledged"),
        ("gone, acknowledged, allowed", 10, "auto_on", "restart", "output !full_stop !restart_needed"),
        ("both at once", 10, "auto_on full", "", "!output restart_needed"),
        ("both at once", 10, "auto_on", "ack restart", "output"),
    ]);
    run(with(RestartRule::CommandEarly), &[
        ("early: not before the acknowledgement", 0, "auto_on full", "", "restart_needed"),
        ("early: not before the acknowledgement", 10, "auto_on full", "restart", "restart_needed"),
        ("early: also while it is there", 10, "auto_on full", "ack restart", "!restart_needed full_stop !output"),
        ("early: it lets go when it is gone", 10, "auto_on", "", "output !full_stop"),
        ("early: a new one needs a new command", 10, "auto_on full", "restart ack", "restart_needed !output"),
    ]);
}

#[test]
fn full_stop_at_start() {
    let with = |rule| OnOffSettings { full_stop_at_start: true, ..with(rule) };
    let stands = "!output interlocked full_stop unacknowledged";
    run(with(RestartRule::Acknowledge), &[
        ("the actuator does not start by itself", 0, "first auto_on", "", stands),
        ("the actuator does not start by itself", 10, "auto_on", "restart", "!output full_stop !restart_needed"),
        ("in manual mode neither, and an order given meanwhile is not kept", 10, "", "manual on", "!output !manual_order"),
        ("acknowledged, it waits for an order", 10, "", "ack", "!output !full_stop !interlocked !unacknowledged"),
        ("and follows it", 10, "", "on", "output"),
    ]);
    run(with(RestartRule::Acknowledge), &[
        ("an acknowledgement from before it hides nothing", 0, "first auto_on", "ack restart", stands),
        ("acknowledged, the standing order of the logic is followed", 10, "auto_on", "ack", "output !full_stop"),
    ]);
    run(with(RestartRule::Command), &[
        ("the restart is needed too", 0, "first auto_on", "", "!output full_stop restart_needed unacknowledged"),
        ("not before the acknowledgement", 10, "auto_on", "restart", "!output restart_needed"),
        ("an acknowledgement is not enough", 10, "auto_on", "ack", "!output full_stop restart_needed !unacknowledged"),
        ("nor is the command while a full stop is there", 10, "auto_on full", "ack restart", "!output restart_needed"),
        ("acknowledged, gone, allowed", 10, "auto_on", "ack restart", "output !full_stop !restart_needed"),
    ]);
    run(with(RestartRule::CommandEarly), &[
        ("early: the restart is needed too", 0, "first auto_on full", "ack restart", "!output restart_needed unacknowledged"),
        ("early: allowed while a full stop is there", 10, "auto_on full", "ack restart", "!output full_stop !restart_needed"),
        ("early: it lets go when it is gone", 10, "auto_on", "", "output !full_stop"),
    ]);
    run(OnOffSettings { fail_safe_on: true, ..with(RestartRule::Acknowledge) }, &[
        ("the fail-safe position is on", 0, "first auto_off", "", "output interlocked full_stop"),
        ("and is left after the acknowledgement", 10, "auto_off", "ack", "!output !full_stop"),
    ]);
    for rule in [RestartRule::Acknowledge, RestartRule::Command, RestartRule::CommandEarly] {
        run(with(rule), &[("a restored state goes on: nothing latches but at a first execution", 0, "auto_on", "",
            "output !full_stop !restart_needed !unacknowledged")]);
    }
}

#[test]
fn interlocks_win_in_every_mode() {
    for mode in ["auto_on", "manual", "forced", "local local_on"] {
        let local = mode.starts_with("local");
        let (given, command) = match mode {
            "manual" | "forced" => ("", mode),
            _ => (mode, ""),
        };
        let stay = if local { "local" } else { "" };
        let on = if command.is_empty() { "" } else { "on" };
        run(OnOffSettings::default(), &[
            (mode, 0, given, command, "!interlocked"),
            (mode, 10, given, on, "output"),
            (mode, 10, &format!("{given} full"), on, "!output interlocked"),
            (mode, 10, given, on, "!output interlocked full_stop"),
            (mode, 10, stay, "ack", "!output !interlocked"),
            (mode, 10, given, on, "output"),
            (mode, 10, &format!("{given} temporary"), on, "!output interlocked"),
            (mode, 10, given, on, "output"),
        ]);
    }
}

#[test]
fn fail_safe_on() {
    run(OnOffSettings { fail_safe_on: true, ..OnOffSettings::default() }, &[
        ("before any order it is in its fail-safe position", 0, "first", "", "output auto_order manual_order !interlocked"),
        ("before any order it is in its fail-safe position", 10, "", "", "output"),
        ("the logic orders off", 10, "auto_off", "", "!output !auto_order"),
        ("and the order stays", 10, "", "", "!output"),
        ("a stop takes it on", 10, "auto_off temporary", "", "output interlocked"),
        ("and off again", 10, "auto_off", "", "!output"),
        ("a full stop takes it on", 10, "full", "", "output interlocked auto_order"),
        ("and it stays there until it is ordered off", 10, "", "ack", "output !interlocked"),
        ("a start interlock keeps it from leaving the fail-safe position", 10, "auto_off start", "", "output interlocked"),
        ("and lets it go when gone", 10, "auto_off", "", "!output"),
        ("and then stops nothing", 10, "auto_off start", "", "!output !interlocked"),
    ]);
}

#[test]
fn feedbacks() {
    let settings = OnOffSettings { feedback_timeout: 100 * MS, ..OnOffSettings::default() };
    run(OnOffSettings { has_feedback_on: true, has_feedback_off: true, ..settings }, &[
        ("off, and says so", 0, "feedback_off", "", "off !on !moving"),
        ("ordered on, it moves", 10, "auto_on feedback_off", "", "output off !on moving !position_alarm"),
        ("between the feedbacks it is neither on nor off", 50, "auto_on", "", "!on !off moving"),
        ("within its time it arrives", 49, "auto_on feedback_on", "", "on !off !moving !position_alarm"),
        ("lost on the way, the time begins", 10, "auto_on", "", "!on !off moving"),
        ("not there in time is an alarm", 99, "auto_on", "", "moving !position_alarm"),
        ("not there in time is an alarm", 1, "auto_on", "", "position_alarm !moving unacknowledged output"),
        ("a new order has the whole time", 10, "auto_off", "ack", "!position_alarm moving !unacknowledged"),
        ("a new order has the whole time", 99, "", "", "!position_alarm"),
        ("a new order has the whole time", 1, "", "ack", "position_alarm unacknowledged"),
        ("arrived, the alarm ends", 1, "feedback_off", "", "!position_alarm off unacknowledged"),
        ("both feedbacks at once are a difference", 1, "feedback_off feedback_on", "", "on off moving"),
    ]);
    run(OnOffSettings { has_feedback_on: true, ..settings }, &[
        ("with one feedback off is its inverse", 0, "auto_on", "", "output !on off moving"),
        ("with one feedback off is its inverse", 10, "auto_on feedback_on", "", "on !off !moving"),
        ("an interlock is supervised too", 10, "auto_on feedback_on temporary", "", "!output on moving"),
        ("an interlock is supervised too", 100, "auto_on feedback_on temporary", "", "position_alarm"),
    ]);
    run(OnOffSettings { has_feedback_off: true, ..settings }, &[
        ("with the other one on is its inverse", 0, "feedback_off", "", "off !on !moving"),
        ("with the other one on is its inverse", 10, "auto_on", "", "on !off !moving"),
    ]);
    run(settings, &[
        ("without any it is what the output says", 0, "auto_on", "", "on !off !moving"),
        ("without any there is no alarm", 9_999, "auto_on feedback_off", "", "on !position_alarm"),
    ]);
}
