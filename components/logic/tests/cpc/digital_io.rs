//! DigitalInput and DigitalOutput: position, forced, I/O error, simulated, and whether an output arrived.

use crate::{MS, Row, expect, from_words, to_words};
use latchwork_logic::{
    Quality,
    cpc::{
        Binary, DigitalInput, DigitalInputSettings, DigitalOutput, DigitalOutputInputs, DigitalOutputSettings,
        ForceCommands,
    },
};

fn commands(words: &str) -> ForceCommands {
    from_words!(words, ForceCommands::default();
        "force_true" => force_true, "force_false" => force_false, "unforce" => unforce)
}

#[derive(Default)]
struct Raw {
    raw: bool,
    bad: bool,
    uncertain: bool,
    simulated: bool,
}

fn run_input(inverted: bool, rows: &[Row<'_>]) {
    let (settings, mut input) = (DigitalInputSettings { inverted }, DigitalInput::default());
    for &(rule, _, inputs, command, expected) in rows {
        let raw = from_words!(inputs, Raw::default();
            "raw" => raw, "bad" => bad, "uncertain" => uncertain, "simulated" => simulated);
        let quality = match raw {
            Raw { bad: true, .. } => Quality::Bad,
            Raw { uncertain: true, .. } => Quality::Uncertain,
            _ => Quality::Good,
        };
        let out = input.execute(&settings, Binary::new(raw.raw, quality), raw.simulated, commands(command));
        let mut got = to_words!(out.status; position forced io_error simulated measured forced_differs);
        assert_eq!(out.position.value, out.status.position, "{rule}: the position is in the register");
        got.extend([("good", out.position.quality == Quality::Good), ("bad", out.position.quality == Quality::Bad)]);
        expect(rule, expected, &got);
    }
}

#[test]
fn digital_input() {
    run_input(false, &[
        ("the position is the raw signal", 0, "", "", "!position !measured good !io_error !forced"),
        ("the position is the raw signal", 0, "raw", "", "position measured good !forced_differs"),
        ("bad quality is an I/O error, and goes on with the position", 0, "raw bad", "", "position io_error bad"),
        ("uncertain quality is none", 0, "raw uncertain", "", "position !io_error !good !bad"),
        ("simulated is shown", 0, "raw simulated", "", "simulated position"),
        ("forced, the position follows the operator", 0, "raw", "force_false", "!position forced measured forced_differs"),
        ("forced, it stays whatever the field does", 0, "", "", "!position forced !measured !forced_differs"),
        ("forced, it is good even where the field is not", 0, "bad", "", "!position forced io_error good"),
        ("forced to the other value", 0, "", "force_true", "position forced forced_differs"),
        ("false wins over true", 0, "", "force_true force_false", "!position forced"),
        ("unforce wins over both", 0, "raw", "force_true force_false unforce", "position !forced !forced_differs"),
        ("let go, it follows the field", 0, "", "", "!position !forced"),
    ]);
    run_input(true, &[
        ("inverted, false is true", 0, "", "", "position measured"),
        ("inverted, true is false", 0, "raw", "", "!position !measured"),
        ("a forced position is not inverted", 0, "raw", "force_true", "position forced !measured forced_differs"),
    ]);
}

fn run_output(settings: DigitalOutputSettings, rows: &[Row<'_>]) {
    let mut output = DigitalOutput::default();
    for &(rule, ms, inputs, command, expected) in rows {
        let inputs = from_words!(inputs, DigitalOutputInputs::default();
            "order" => order, "readback" => readback, "io_error" => io_error, "simulated" => simulated);
        let out = output.execute(&settings, ms * MS, inputs, commands(command));
        let mut got = to_words!(out.status; position forced io_error simulated order forced_differs mismatch);
        got.push(("output", out.output));
        expect(rule, expected, &got);
    }
}

#[test]
fn digital_output() {
    let settings = DigitalOutputSettings::default();
    run_output(settings, &[
        ("the output is the order", 0, "", "", "!output !position !order"),
        ("the output is the order", 10, "order", "", "output position order !forced"),
        ("an error of the channel is shown and changes nothing", 10, "order io_error", "", "output io_error"),
        ("simulated is shown", 10, "order simulated", "", "output simulated !io_error"),
        ("forced, the output follows the operator", 10, "order", "force_false", "!output !position order forced_differs"),
        ("forced, it stays whatever is ordered", 10, "", "", "!output forced !forced_differs"),
        ("let go, it follows the order", 10, "order", "unforce", "output !forced !forced_differs"),
        ("without a read-back there is no mismatch", 9_999, "order", "", "output !mismatch"),
    ]);
    run_output(DigitalOutputSettings { inverted: true, ..settings }, &[
        ("inverted, the output is the inverse of the position", 0, "", "", "output !position"),
        ("inverted, a forced position is inverted too", 10, "", "force_true", "!output position"),
    ]);
    run_output(DigitalOutputSettings { has_readback: true, mismatch_time: 100 * MS, ..settings }, &[
        ("the field may take its time", 0, "order", "", "output !mismatch"),
        ("the field may take its time", 99, "order", "", "!mismatch"),
        ("a difference that lasts is a mismatch", 1, "order", "", "mismatch"),
        ("it ends when the field follows", 10, "order readback", "", "!mismatch"),
        ("a new order has the whole time", 10, "readback", "", "!output !mismatch"),
        ("a new order has the whole time", 90, "readback", "", "!mismatch"),
        ("a new order has the whole time", 5, "order", "", "!mismatch"),
        ("a new order has the whole time", 99, "order", "", "!mismatch"),
        ("a new order has the whole time", 1, "order", "", "mismatch"),
    ]);
}
